#include "modal_run.hpp"

#include "modal_lanes.hpp"

namespace tarsus {

namespace {

// How a run ended, and what it logged.
struct Ended {
  Code code;
  double time, steps, rejected;
  std::vector<Event> events;

  Ended() = default;
  Ended(Code how, Modal& m) : code(how), time(m.clock.time), steps(double(m.clock.steps)), rejected(double(m.clock.rejected)) {
    events.swap(m.log.events);
  }
};

// What the last run leaves for one that goes on from there.
void leave(ModalResult& out, Modal& m) {
  out.trace = std::move(m.trace);
  out.mode = m.mode;
  out.pending = m.entering ? m.next : nullptr;
  out.physical = m.physical;
  const int nb = m.mode == nullptr ? 0 : m.mode->blocks_used;
  out.state.assign(m.state(), m.state() + nb);
  out.state.insert(out.state.end(), m.state() + m.sizes.stride, m.state() + m.sizes.stride + nb);
}

// Runs of a batch side by side: those whose next step can be made in a lane wait in a queue with others of their contact
// mode and step class, eight of which make it at once. Everything else a run does by itself.
template <class S>
class Crew {
 public:
  typedef LaneRun<S> Run;

  Crew(Book& book, const Nodes& nodes, const Signals& signals, const Laws& laws, const Settings& settings, const Batch& batch)
      : batch_(batch), lanes_(book.sizes, nodes), queues_(2 * book.classes()), ended_(batch.runs) {
    const size_t slots = std::min<size_t>(batch.runs, SLOTS);
    for (size_t s = 0; s < slots; s++) {
      slots_.push_back(std::make_unique<Run>(book, nodes, signals, laws, settings, batch.channels));
    }
  }

  std::vector<Ended> work(ModalResult& out) {
    out_ = &out;
    for (auto& run : slots_) {
      if (begin(*run)) go_on(*run);
    }
    for (;;) {
      std::vector<Run*>& queue = fullest();
      if (queue.empty()) return std::move(ended_);
      const int count = int(std::min<size_t>(queue.size(), N));
      Run* runs[N];
      std::copy(queue.end() - count, queue.end(), runs);
      queue.resize(queue.size() - count);
      lanes_.attempt(runs, count);
      for (int l = 0; l < count; l++) close(*runs[l], l);
    }
  }

 private:
  static constexpr size_t SLOTS = 64;  // runs under way: enough to fill the lanes of some ten queues, few enough for a cache
  const Batch& batch_;
  Lanes<S> lanes_;
  std::vector<std::vector<Run*>> queues_;  // by contact mode, free and held, and step class
  std::vector<int> full_;  // those that have come to fill the lanes once more
  std::vector<Ended> ended_;
  std::vector<std::unique_ptr<Run>> slots_;
  ModalResult* out_ = nullptr;
  size_t next_ = 0;

  // Start the next run of the batch. False where there is none left.
  bool begin(Run& run) {
    if (next_ == batch_.runs) return false;
    run.begin(next_, batch_.of(next_));
    next_++;
    return true;
  }

  void wait(Run& run) {
    const int q = run.mode->is_held[0] * run.book.classes() + run.trial.k;
    queues_[q].push_back(&run);
    if (queues_[q].size() % N == 0) full_.push_back(q);
  }

  bool waits(Run& run) {
    if (!run.waits()) return false;
    wait(run);
    return true;
  }

  // A queue that fills the lanes, or else the longest one.
  std::vector<Run*>& fullest() {
    while (!full_.empty()) {
      std::vector<Run*>& queue = queues_[full_.back()];
      full_.pop_back();
      if (queue.size() >= N) return queue;
    }
    return *std::max_element(queues_.begin(), queues_.end(), [](const auto& a, const auto& b) { return a.size() < b.size(); });
  }

  // After a step: whether there is a run to go on with, the next one where this one has ended.
  bool goes_on(Run& run, Code code) {
    if (code == GOING_ON && run.clock.progressed(run.settings)) return true;
    if (run.number + 1 == batch_.runs) leave(*out_, run);
    ended_[run.number] = Ended(code == GOING_ON ? STALL : code, run);
    return begin(run);
  }

  // By itself until the next step waits for a lane.
  void go_on(Run& run) {
    Code code;
    do {
      code = due(run);
      if (code != GOING_ON) continue;
      run.before = look_ahead(run);
      if (run.glides(run.before)) continue;
      run.trial = {run.step_class, run.step_class};
      if (waits(run)) return;
      code = run.go_on(run.before, run.trial);
    } while (goes_on(run, code));
  }

  void close(Run& run, int lane) {
    Taken taken;
    Code code = GOING_ON;
    switch (lanes_.close(lane, taken)) {
      case Lanes<S>::QUIET:
        if (!run.mode->is_held[0] && run.waits_again()) return wait(run);
        run.settle();
        break;
      case Lanes<S>::TAKEN: code = run.end(taken); break;
      case Lanes<S>::AGAIN:
        if (waits(run)) return;
        code = run.go_on(run.before, run.trial);
    }
    if (goes_on(run, code)) go_on(run);
  }
};

// One run after the other.
template <class S>
std::vector<Ended> one_by_one(Book& book, const Nodes& nodes, const Signals& signals, const Laws& laws,
                              const Settings& settings, const Batch& batch, ModalResult& out) {
  ModalSystem<S> system(book, nodes, signals, laws, settings, batch.channels);
  std::vector<Ended> ended(batch.runs);
  for (size_t run = 0; run < batch.runs; run++) {
    system.begin(batch.of(run));
    const Code code = march(system);
    if (run + 1 == batch.runs) leave(out, system);
    ended[run] = Ended(code, system);
  }
  return ended;
}

template <class S>
ModalResult run_all(Book& book, const Nodes& nodes, const Signals& signals, const Laws& laws, const Settings& settings,
                    const Batch& batch) {
  ModalResult out;
  const bool lanes = batch.runs > 1 && book.sizes.feet == 1 && !settings.record;
  std::vector<Ended> ended = lanes ? Crew<S>(book, nodes, signals, laws, settings, batch).work(out)
                                         : one_by_one<S>(book, nodes, signals, laws, settings, batch, out);
  for (Ended& run : ended) {
    out.codes.push_back(run.code);
    if (out.events.empty()) {
      out.events.swap(run.events);
    } else {
      out.events.insert(out.events.end(), run.events.begin(), run.events.end());
    }
    out.event_end.push_back(int64_t(out.events.size()));
    out.finish.insert(out.finish.end(), {run.time, run.steps, run.rejected});
  }
  return out;
}

}  // namespace

int modal_stride(int modes) {
  if (modes <= 2) return 2;
  if (modes <= 4) return 4;
  return (modes + 7) / 8 * 8;
}

ModalResult run_modal(Book& book, const Nodes& nodes, const Signals& signals, const Laws& laws, const Settings& settings,
                      const Batch& batch) {
  switch (book.sizes.stride) {
    case 2: return run_all<Shape<2, 1>>(book, nodes, signals, laws, settings, batch);
    case 4: return run_all<Shape<4, 1>>(book, nodes, signals, laws, settings, batch);
    case 8: return run_all<Shape<WIDEST, 8 / WIDEST>>(book, nodes, signals, laws, settings, batch);
    default: return run_all<Shape<WIDEST, 0>>(book, nodes, signals, laws, settings, batch);
  }
}

}  // namespace tarsus

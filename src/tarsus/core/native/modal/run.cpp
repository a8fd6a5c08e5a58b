#include "modal/run.hpp"

#include "modal/system.hpp"

namespace tarsus::modal {

namespace {

// A system that can start anywhere.
template <class S>
struct Begun : ModalSystem<S> {
  using ModalSystem<S>::ModalSystem;

  size_t recorded() const { return this->trace.size() / recorded_width(this->sizes); }

  void begin_at(const RunData& run, const Beginning& start) {
    this->begin(run);
    this->settings = start.ended(this->settings);
    start_clock(this->clock, this->settings, start);
    FootSet on(this->sizes.constraints());
    if (start.feet != nullptr) return go_on_from(start.feet, on);
    for (int i = 0; i < this->sizes.feet; i++) {
      Foot& foot = this->feet[i];
      foot.apex.restart(start.time);
      if (start.held[i]) {
        on.toggle(i);
        foot.since = start.since[i];
        if (this->frictional[i]) begin_along(run, i, on);
      } else {
        foot.parted = start.time;
        if (start.leaving[i]) foot.departure = FROM_REST;
      }
    }
    this->next = &this->book.require(on);
  }

  // The feet as they are: what is carried on to another part of the run.
  void hand_on(std::vector<CarriedFoot>& out) const {
    for (int i = 0; i < this->sizes.feet; i++) {
      const Foot& foot = this->feet[i];
      const Contact contact = this->next->is_stuck[i] ? STUCK : this->next->is_held[i] ? SLIPPING : AIR;
      CarriedFoot one = handed_on(contact, foot, foot.apex);
      one.left = foot.left;
      one.rose = foot.rose;
      one.low = foot.low;
      one.start = foot.departure;
      one.slide = foot.slide;
      one.sense = foot.sense;
      one.place = foot.place;
      one.due = this->check;
      out.push_back(one);
    }
  }

 private:
  void go_on_from(const CarriedFoot* from, FootSet& on) {
    bool due = this->sizes.feet == 0;
    for (int i = 0; i < this->sizes.feet; i++) {
      const CarriedFoot& one = from[i];
      Foot& foot = this->feet[i];
      take_on(one, foot, foot.apex);
      foot.left = one.left;
      foot.rose = one.rose;
      foot.low = int(one.low);
      foot.departure = int(one.start);
      foot.slide = int(one.slide);
      foot.sense = one.sense;
      foot.place = one.place;
      if (one.contact != AIR) on.toggle(i);
      if (one.contact == STUCK) on.toggle(this->sizes.feet + i);
      due = due || one.due != 0.0;
    }
    this->next = &this->book.require(on);
    this->player.next_kink(this->clock.time);
    this->enter();
    this->check = due;
  }

  // A held foot that has nothing along the ground sticks there.
  void begin_along(const RunData& run, int i, FootSet& on) {
    const int n = this->sizes.coordinates;
    const std::vector<double> place(run.initial, run.initial + n), velocity(run.initial + n, run.initial + 2 * n);
    const double rate = this->book.place_along(i, velocity);
    Foot& foot = this->feet[i];
    foot.place = this->book.place_along(i, place);
    foot.sense = std::fabs(rate) <= this->settings.speed_zero ? 0.0 : rate > 0.0 ? 1.0 : -1.0;
    if (foot.sense == 0.0) on.toggle(this->sizes.feet + i);
  }
};

// Where the last run ended. The momenta at the end of the last step determine the velocities there: they do not jump once more, as no
// step follows.
void note_end(Modal& m, ModalResult& out) {
  if (!m.entering) {
    if (m.settings.record && !m.trace.empty()) {
      for (int i : m.mode->free) {
        if (m.laws.has(i, HAS_MOMENTUM)) m.shift(m.mode->beta, i, m.feet[i].momentum);
      }
      m.trace[m.trace.size() - recorded_width(m.sizes) + T_JUMPS] -= m.jumped;
    } else {
      add_film_momenta(m);
    }
    leave_mode(m, *m.mode);
  }
  out.mode = m.mode;
  out.pending = m.next;
  out.physical = m.physical;
}

template <class S>
ModalResult run_all(const Robot& robot, const std::vector<RunData>& runs, const std::vector<Beginning>& starts) {
  Begun<S> system(robot.book, robot.nodes, robot.signals, robot.laws, robot.settings, robot.channels);
  ModalResult out;
  Watched<Begun<S>> watched(system, out.notes);
  for (size_t run = 0; run < runs.size(); run++) {
    if (starts.empty()) {
      system.begin(runs[run]);
    } else {
      system.begin_at(runs[run], starts[run]);
    }
    out.codes.push_back(march(watched));
    out.event_end.push_back(int64_t(system.log.events.size()));
    out.trace_end.push_back(int64_t(system.recorded()));
    const Clock& clock = system.clock;
    out.finish.insert(out.finish.end(), {clock.time, double(clock.steps), double(clock.rejected)});
    if (starts.empty() && run + 1 < runs.size()) continue;
    note_end(system, out);
    if (starts.empty()) continue;
    out.states.insert(out.states.end(), system.physical.begin(), system.physical.end());
    system.hand_on(out.feet);
  }
  out.events = std::move(system.log.events);
  out.trace = std::move(system.trace);
  return out;
}

}  // namespace

ModalResult run_modal(const Robot& robot, const std::vector<RunData>& runs, const std::vector<Beginning>& starts) {
  return by_shape(robot.book.sizes.stride, [&](auto shape) { return run_all<decltype(shape)>(robot, runs, starts); });
}

}  // namespace tarsus::modal

#include "modal/run.hpp"

#include "modal/system.hpp"

namespace tarsus::modal {

namespace {

CarriedFoot save_foot(const Modal& m, int i) {
  const Foot& foot = m.feet[i];
  const Contact contact = m.next->is_stuck[i] ? STUCK : m.next->is_held[i] ? SLIPPING : AIR;
  CarriedFoot out = tarsus::save_foot(contact, foot, foot.apex);
  out.left = foot.left;
  out.rose = foot.rose;
  out.low = foot.low;
  out.start = foot.departure;
  out.slide = foot.slide;
  out.sense = foot.sense;
  out.place = foot.place;
  out.due = m.check;
  return out;
}

// A held foot that has nothing along the ground sticks there; whether it does.
bool begins_stuck(Modal& m, const RunData& run, int i) {
  const int n = m.sizes.coordinates;
  const std::vector<double> place(run.initial, run.initial + n), velocity(run.initial + n, run.initial + 2 * n);
  const double rate = m.book.place_along(i, velocity);
  Foot& foot = m.feet[i];
  foot.place = m.book.place_along(i, place);
  foot.sense = std::fabs(rate) <= m.settings.speed_zero ? 0.0 : rate > 0.0 ? 1.0 : -1.0;
  return foot.sense == 0.0;
}

// Whether it sticks.
bool load_foot(Modal& m, const RunData& run, int i, const CarriedFoot& from) {
  Foot& foot = m.feet[i];
  tarsus::load_foot(from, foot, foot.apex);
  foot.left = from.left;
  foot.rose = from.rose;
  foot.low = int(from.low);
  foot.departure = from.started(FROM_REST);
  foot.slide = int(from.slide);
  foot.place = from.place;
  if (from.as_it_moves()) return m.frictional[i] && begins_stuck(m, run, i);
  foot.sense = from.sense;
  return from.contact == STUCK;
}

// A system that can start anywhere.
template <class S>
struct StartedSystem : ModalSystem<S> {
  using ModalSystem<S>::ModalSystem;

  size_t recorded() const { return this->trace.size() / recorded_width(this->sizes); }

  void load(const RunData& run, const Start& start) {
    this->begin(run);
    this->settings.end = start.end;
    this->clock = clock_at(start);
    FootSet on(this->sizes.constraints());
    bool due = this->sizes.feet == 0;
    for (int i = 0; i < this->sizes.feet; i++) {
      const CarriedFoot& from = start.feet[i];
      if (load_foot(*this, run, i, from)) on.toggle(this->sizes.feet + i);
      if (from.contact != AIR) on.toggle(i);
      due = due || from.due != 0.0;
    }
    this->next = &this->book.require(on);
    this->player.next_kink(this->clock.time);
    this->enter();
    this->check = due;
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
  out.changed = m.mode != m.next;
  out.states.insert(out.states.end(), m.physical.begin(), m.physical.end());
  for (int i = 0; i < m.sizes.feet; i++) out.feet.push_back(save_foot(m, i));
}

template <class S>
ModalResult run_all(const Robot& robot, const std::vector<RunData>& runs, const std::vector<Start>& starts) {
  StartedSystem<S> system(robot.book, robot.nodes, robot.signals, robot.laws, robot.settings, robot.channels);
  ModalResult out;
  for (size_t run = 0; run < runs.size(); run++) {
    if (starts.empty()) {
      system.begin(runs[run]);
    } else {
      system.load(runs[run], starts[run]);
    }
    const Code code = march(system);
    out.note(code, system.clock, system.log);
    out.trace_end.push_back(int64_t(system.recorded()));
    if (!starts.empty() || run + 1 == runs.size()) note_end(system, out);
  }
  out.events = std::move(system.log.events);
  out.trace = std::move(system.trace);
  return out;
}

}  // namespace

ModalResult run_modal(const Robot& robot, const std::vector<RunData>& runs, const std::vector<Start>& starts) {
  return by_shape(robot.book.sizes.stride, [&](auto shape) { return run_all<decltype(shape)>(robot, runs, starts); });
}

}  // namespace tarsus::modal

#include "modal/run.hpp"

#include <optional>

#include "modal/account.hpp"
#include "modal/samples.hpp"
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
  if (foot.sense == 0.0) foot.supposed = m.clock.time;
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

// Samples and account of runs as they march.
template <class S>
class RunOutputs final : public StepObserver {
 public:
  std::vector<double> samples;  // (times of all runs, width)

  RunOutputs(Modal& m, bool account) : m_(m), step_(m.sizes) {
    if (account) account_.emplace(m);
  }

  size_t width() const { return sample_width(m_.sizes) + (account_ ? account_->sums.size() : 0); }

  // A run begins; its times increase.
  void begin(const RunData& run, const SampleTimes& times) {
    if (account_) account_->begin(run);
    if (times.count > 0 && !sampler_) sampler_.emplace(m_);
    if (sampler_) sampler_->begin(run);
    step_.mode = nullptr;
    times_ = times;
    sampled_ = 0;
    samples.resize(samples.size() + times.count * width(), 0.0);
    m_.observer = account_ || times.count > 0 ? this : nullptr;
  }

  void accepted(const StepClass& step, double begun, double fraction) override {
    step_.take(m_, step, begun, fraction);
    if (account_) account_->add(step_);
    while (sampled_ < times_.count && times_.at[sampled_] < step_.ended) sample();  // at its end the next one begins
  }

  // A run has ended: times that are left are those of its end. goes_on: see Account.
  void end(bool goes_on) {
    if (account_) account_->end(goes_on);
    while (step_.mode != nullptr && sampled_ < times_.count) sample();
  }
  void note_end(ModalResult& out) const {
    if (!account_) return;
    out.energies.insert(out.energies.end(), account_->sums.begin(), account_->sums.end());
    out.gap_range = account_->gap_range();
  }

 private:
  Modal& m_;
  AcceptedStep step_;
  std::optional<Sampler<S>> sampler_;
  std::optional<Account> account_;
  SampleTimes times_ = {};
  size_t sampled_ = 0;

  void sample() {
    const double s = std::min(std::max((times_.at[sampled_] - step_.begun) / step_.tables->length, 0.0), step_.fraction);
    double* to = samples.data() + samples.size() - (times_.count - sampled_++) * width();
    sampler_->sample(step_, s, to);
    if (!account_) return;
    const double share = step_.fraction > 0.0 ? s / step_.fraction : 1.0;  // within a step energies are taken as linear
    to += sample_width(m_.sizes);
    for (size_t e = 0; e < account_->sums.size(); e++) to[e] = account_->before_step[e] + (account_->sums[e] - account_->before_step[e]) * share;
  }
};

// Whether momenta of films jump once more at the end of a run: not where a step ended there, which determines its velocities.
bool jumps_at_end(const Modal& m, Code code) { return m.entering || code != DONE || std::isnan(m.ended); }

// Where the last run ended.
void note_end(Modal& m, Code code, ModalResult& out) {
  if (!m.entering) {
    if (jumps_at_end(m, code)) {
      add_film_momenta(m);
    } else {
      for (int i : m.mode->free) {
        if (m.laws.has(i, HAS_MOMENTUM)) m.shift(m.mode->beta, i, m.momentum_at(i, m.ended));
      }
    }
    leave_mode(m, *m.mode);
  }
  out.changed = m.mode != m.next;
  out.states.insert(out.states.end(), m.physical.begin(), m.physical.end());
  for (int i = 0; i < m.sizes.feet; i++) out.feet.push_back(save_foot(m, i));
}

template <class S>
ModalResult run_all(const Robot& robot, const std::vector<RunData>& runs, const std::vector<Start>& starts,
                    const std::vector<SampleTimes>& times, bool account) {
  StartedSystem<S> system(robot.book, robot.nodes, robot.signals, robot.laws, robot.settings, robot.channels);
  RunOutputs<S> outputs(system, account);
  ModalResult out;
  for (size_t run = 0; run < runs.size(); run++) {
    outputs.begin(runs[run], times.empty() ? SampleTimes{} : times[run]);
    if (starts.empty()) {
      system.begin(runs[run]);
    } else {
      system.load(runs[run], starts[run]);
    }
    Code code = march(system);
    if (code == STEP_TOO_SMALL && !system.entering && jams_as_it_slows(system)) code = JAMMED;
    outputs.end(jumps_at_end(system, code));
    out.note(code, system.clock, system.log);
    if (starts.empty() && run + 1 < runs.size()) continue;
    outputs.note_end(out);
    note_end(system, code, out);
  }
  out.events = std::move(system.log.events);
  out.samples = std::move(outputs.samples);
  out.sample_width = outputs.width();
  out.energy_width = ENERGIES + system.laws.shares();
  return out;
}

}  // namespace

ModalResult run_modal(const Robot& robot, const std::vector<RunData>& runs, const std::vector<Start>& starts,
                      const std::vector<SampleTimes>& times, bool account) {
  return by_shape(robot.book.sizes.stride, [&](auto shape) { return run_all<decltype(shape)>(robot, runs, starts, times, account); });
}

}  // namespace tarsus::modal

// The derivative by a number of the structure itself: every step and every event of the run, from its own state and inputs,
// by structures that differ in that number alone. What they come to, weighted by a stencil, is the number's own part; all
// else follows from it as for every other number.
#pragma once
#include "tangent_instant.hpp"

namespace tarsus::modal {

// One of the structures beside the run's, and its weight in the difference of a lane.
struct Beside {
  Book* book;
  std::vector<double> sources;
  double weight;
  int lane;
};

class Shadow {
 public:
  const double weight;
  const int lane;
  Instant instant;

  Shadow(const Beside& of, LawTangents& laws, const Settings& settings)
      : weight(of.weight), lane(of.lane), instant(*of.book, laws, settings, plain(of.sources)), book_(*of.book),
        sources_(of.sources), entering_(of.book->sizes) {}

  // Begin an instant, or a step, of the run at its displacements and velocities.
  void begin_instant(const Instant& run, const std::vector<Jet>& place) {
    instant.time = Jet(run.time.value);
    instant.drives = still(run.drives);
    instant.since = still(run.since);
    instant.enter(book_.require(run.mode->feet), still(place));
  }

  void begin_step(const ContactMode& mode, int step_class, const std::vector<double>& place, const Entering<double>& run) {
    mode_ = &book_.require(mode.feet);
    step_class_ = step_class;
    const int n2 = int(place.size());
    entering_.inputs = run.inputs;
    entering_.sources = sources_;
    std::vector<double> off(n2);
    for (int r = 0; r < n2; r++) {
      off[r] = place[r];
      for (size_t q = 0; q < sources_.size(); q++) off[r] -= sources_[q] * mode_->bias_offset[q * n2 + r];
    }
    for (int k = 0; k < mode.sizes.state(); k++) {
      double sum = 0.0;
      for (int r = 0; r < n2; r++) sum += mode_->from_physical[k * n2 + r] * off[r];
      for (int i : mode_->free) sum -= mode_->beta[i * mode.sizes.state() + k] * run.input(i)[0];
      entering_.state[k] = sum;
    }
  }

  // Add what this structure makes of an output at the nodes of the step to that lane.
  void add_outputs(const std::vector<int>& acting, int output, Row* to) const {
    double line[N];
    outputs_at_nodes(book_.step(*mode_, step_class_), acting, entering_, output, line);
    for (int j = 0; j < N; j++) to[j].set(lane, to[j][lane] + weight * line[j]);
  }

  // What it makes of the moment s of the step.
  Shown<double> at(const Nodes& nodes, const Halves& halves, double length, double s, const std::vector<int>& acting) const {
    Shown<double> out(mode_->sizes);
    std::vector<double> state;
    Inside<double> room(mode_->sizes);
    within_step(book_, nodes, halves, *mode_, step_class_, s, acting, entering_, room, state);
    show(*mode_, nodes, length, s, acting, entering_, state, out);
    return out;
  }

  void add(double value, Row& to) const { to.set(lane, to[lane] + weight * value); }

 private:
  Book& book_;
  std::vector<double> sources_;
  Entering<double> entering_;
  const ContactMode* mode_ = nullptr;
  int step_class_ = 0;

  static std::vector<Jet> plain(const std::vector<double>& values) { return std::vector<Jet>(values.begin(), values.end()); }
  static std::vector<Jet> still(const std::vector<Jet>& values) {
    std::vector<Jet> out;
    for (const Jet& one : values) out.push_back(Jet(one.value));
    return out;
  }
};

}  // namespace tarsus::modal

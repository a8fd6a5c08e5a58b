// Steps of a recorded run backwards: from what a number depends on after a step to what it depends on before, and by which data.
//
// A step's tangents solve (1 - G S) dy = L dw + G own, and everything after it is linear in them. Of a number J whose
// derivatives by what comes out of the step are known, those by what enters follow by the transposed maps, with
//   (1 - G S)^T mu = S^T u + (what J makes of the gaps),   u: derivatives of J by the forces,
// and those by the data from what these do to forces, drives and sources at the nodes.
#pragma once
#include "derive/adjoint_instant.hpp"

namespace tarsus::modal {

// What of a run a number depends on, and how. events (events, EVENT_WIDTH); times [s] (count); samples (count, sample width
// less held).
struct Objective {
  const double *events, *times, *samples;
  size_t count;
};

// refused: feet that land at one moment hand blows on to each other, or a step could not be followed. edges: of channels that
// begin with a jump at the very start: piece, turns, channel that is driven.
struct AdjointResult {
  DataAdjoint data;
  std::vector<TangentFlag> flags;
  std::vector<int64_t> edges;
  bool refused = false;
};

// What lists of instants and steps the way back needs, beside the record of the run.
struct Passed {
  struct Mark {
    size_t event;
    double turns, rate, gap;  // turns: of the period, 0 where it is no end of one; rate of the highest gap at the mark
    bool rising;
  };
  struct Kink {
    size_t row;
    int channel;
  };
  std::vector<InstantMap> instants;
  std::vector<Mark> marks;
  std::vector<Kink> kinks;
  std::vector<Cursor> cursors;          // (places, channels): before the first step, and wherever one moves
  std::vector<size_t> moved;            // (places): the first step that has them
  std::vector<size_t> events, samples;  // of every step: number of the first event after it, of the first sample in it
};

// A step of a run backwards.
class StepAdjoint : public Lens {
 public:
  // data: of the lenses; groups (feet, columns): number of the group of each parameter, or -1.
  StepAdjoint(Book& book, const Nodes& nodes, const Halves& halves, const Signals& signals, const Laws& laws, const Settings& settings,
               const RunData& run, const Beginning& start, const std::vector<DataTangents>& data, size_t channels,
               const std::vector<int64_t>& groups, const std::vector<int64_t>& degrees, const Directions& directions)
      : Lens(book, nodes, halves, signals, laws, settings, run, start, data[0], channels, directions, 0), groups_(groups),
        back_(signals, nodes, run, degrees), bar_(sizes_), unit_(sizes_), seed_(sizes_), by_channel_(channels * N) {
    list_rates(laws, run);
    const int m = sizes_.feet;
    DataAdjoint& to = result_.data;
    to.groups.assign(directions.count - directions.groups, 0.0);
    to.initial.assign(2 * sizes_.coordinates, 0.0);
    to.sources.assign(sizes_.sources(), 0.0);
    to.coef.assign(signals.coef.size(), 0.0);
    to.begin.assign(signals.start.size(), 0.0);
    to.end = to.begin;
    to.loops.assign(signals.loop.size(), 0.0);
    to.changes.assign(3 * channels, 0.0);
    by_state_ = nothing_ = std::vector<double>(sizes_.state(), 0.0);
    for (auto* one : {&by_since_, &apex_, &apex_time_, &integral_}) one->assign(m, 0.0);
    by_gap_.assign(m, Row(0.0));
    next_.assign(m, 0);
  }

 protected:
  const std::vector<int64_t>& groups_;
  DrivesBack back_;
  std::vector<LawTangents> rates_;  // each by seven of the parameters of every program
  const Objective* objective_ = nullptr;
  AdjointResult result_;
  Passed passed_;
  Entering<double> bar_;
  Entering<Row> unit_;  // directions of what enters a step
  Shown<double> seed_;
  // Derivatives of the number by: the state; since when feet are held; of the flights that end next, the highest gaps and when,
  // and the integrals; outputs and inputs of an instant; channels, and right sides, at the nodes.
  std::vector<double> nothing_, by_state_, by_since_, apex_, apex_time_, integral_, out_by_, in_by_, by_channel_, right_by_;
  std::vector<Row> by_gap_, forces_by_;
  // What is shown at a moment, of directions and of the number.
  static constexpr std::pair<std::vector<Row> Shown<Row>::*, std::vector<double> Shown<double>::*> PARTS[] = {
      {&Shown<Row>::place, &Shown<double>::place},         {&Shown<Row>::gap, &Shown<double>::gap},
      {&Shown<Row>::rate, &Shown<double>::rate},           {&Shown<Row>::resistive, &Shown<double>::resistive},
      {&Shown<Row>::smooth, &Shown<double>::smooth}, {&Shown<Row>::pull, &Shown<double>::pull}};
  // Terms of a series, of which each must be so much smaller than the one before: else elimination costs less.
  static constexpr int BACK_SERIES = 16;
  static constexpr double FALLING = 0.1;
  std::vector<double> series_, term_, next_term_;
  std::vector<Row> series_forces_;
  double begun_ = 0.0;                     // start of the run [s]
  double by_shared_ = 0.0, margin_ = 0.0;  // by the moment last shared; by the gap or pull of a foot at the end of the step
  int margin_foot_ = 0;

  void list_rates(const Laws& laws, const RunData& run) {
    int most = 0;
    for (const auto& terms : laws.terms) {
      for (const Term& term : terms) most = std::max(most, laws.programs[term.program].parameters);
    }
    for (int from = 0; from < most || from == 0; from += LANES - 1) {
      std::vector<Row> slopes(groups_.size(), Row(0.0));
      for (const auto& terms : laws.terms) {
        for (const Term& term : terms) {
          const int count = std::min(laws.programs[term.program].parameters, from + LANES - 1);
          for (int i = 0; i < laws.feet; i++) {
            for (int k = from; k < count; k++) slopes[size_t(i) * laws.columns + term.first + k] = unit(k - from + 1);
          }
        }
      }
      rates_.emplace_back(laws, run.parameters, slopes);
    }
  }

  // From the end of a step to its start.
  void go_back(size_t r) {
    const ContactMode& mode = *step_.mode;
    const bool whole = step_.fraction == 1.0;
    std::fill(bar_.inputs.begin(), bar_.inputs.end(), 0.0);
    std::fill(bar_.state.begin(), bar_.state.end(), 0.0);
    if (margin_ != 0.0 || !whole) {
      (mode.is_held[margin_foot_] ? seed_.pull : seed_.gap)[margin_foot_] = margin_;
      moment_back(step_.fraction, whole ? nothing_ : by_state_);
    }
    if (whole) {
      end_back(*tables_, acting_, by_state_.data(), bar_);
    } else {
      by_state_ = nothing_;
    }
    for (size_t n = passed_.samples[r]; n < passed_.samples[r + 1]; n++) sampled(n);
    tracked(r);
    linearise_back();
    for (int k = 0; k < sizes_.state(); k++) by_state_[k] += bar_.state[k];
  }

  // What is there at scaled time s of the step, by its state and by ``seed_``, which is left at nothing: the way there on eight
  // unit directions at a time.
  void moment_back(double s, const std::vector<double>& by_state) {
    const ContactMode& mode = *step_.mode;
    std::vector<std::pair<Row*, double*>> entries;
    for (int k = 0; k < sizes_.state(); k++) entries.push_back({&unit_.state[k], &bar_.state[k]});
    for (int i : acting_) {
      for (int j = 0; j < N; j++) entries.push_back({unit_.input(i) + j, bar_.input(i) + j});
    }
    for (int q = 0; q < sizes_.sources(); q++) entries.push_back({&unit_.sources[q], &bar_.sources[q]});
    for (size_t first = 0; first < entries.size(); first += LANES) {
      const size_t last = std::min(first + LANES, entries.size());
      for (size_t n = first; n < last; n++) *entries[n].first = unit(int(n - first));
      within_step(book_, nodes_, halves_, mode, step_.step_class, s, acting_, unit_, slope_room_, inside_);
      show(mode, nodes_, step_.length, s, acting_, unit_, inside_, shown_);
      Row sum = Row(0.0);
      const auto add = [&](const std::vector<Row>& found, const std::vector<double>& by) {
        for (size_t k = 0; k < by.size(); k++) sum += found[k] * by[k];
      };
      add(inside_, by_state);
      for (auto part : PARTS) add(shown_.*part.first, seed_.*part.second);
      for (size_t n = first; n < last; n++) {
        *entries[n].second += sum[n - first];
        *entries[n].first = Row(0.0);
      }
    }
    for (auto part : PARTS) std::fill((seed_.*part.second).begin(), (seed_.*part.second).end(), 0.0);
  }

  void sampled(size_t n) {
    const double* from = objective_->samples + n * (sample_width(sizes_) - sizes_.feet);
    if (std::all_of(from, from + sample_width(sizes_) - sizes_.feet, [](double x) { return x == 0.0; })) return;
    for (auto part : PARTS) {
      std::vector<double>& to = seed_.*part.second;
      std::copy_n(from, to.size(), to.begin());
      from += to.size();
    }
    moment_back(std::min(std::max((objective_->times[n] - step_.time) / step_.length, 0.0), step_.fraction), nothing_);
  }

  // As StepTangents::track.
  void tracked(size_t r) {
    Row weights = Row(0.0);
    double power = step_.fraction * step_.length;
    const bool none = std::all_of(integral_.begin(), integral_.end(), [](double x) { return x == 0.0; });
    for (int c = 0; c < N && !none; c++, power *= step_.fraction) weights += load(nodes_.monomial[c]) * (power / (c + 1));
    for (int i : step_.mode->free) {
      if (nearly_lands(step_, i)) flag(passed_.events[r], NEAR_MISS, -1);
      by_gap_[i] = integral_[i] == 0.0 ? Row(0.0) : weights * integral_[i];
      if ((apex_[i] == 0.0 && apex_time_[i] == 0.0) || !(record_->events[next_[i]].apex > 0.0)) continue;
      const double s = (record_->events[next_[i]].apex_time - step_.time) / step_.length;
      if (!(s >= 0.0 && s <= step_.fraction)) continue;
      const double bend = bend_of(i, s);
      seed_.gap[i] = apex_[i];
      if (s > 0.0 && s < step_.fraction && bend < 0.0) seed_.rate[i] = apex_time_[i] * (-step_.length * step_.length / bend);
      apex_[i] = apex_time_[i] = 0.0;
      moment_back(s, nothing_);
    }
  }

  // From the inputs and gaps at the nodes of a step, ``bar_`` and ``by_gap_``, to its state and the data.
  void linearise_back() {
    const int m = sizes_.feet;
    std::fill(by_channel_.begin(), by_channel_.end(), 0.0);
    if (!smooth_.empty()) forces_back();
    for (int i : step_.mode->free) {
      const bool felt = laws_.has(i, HAS_MOMENTUM) || laws_.has(i, HAS_FORCE);
      if (!felt && integral_[i] != 0.0) drives_back(i, by_gap_[i]);
    }
    for (size_t c = 0; c < channels_; c++) {
      double* by = &by_channel_[N * c];
      if (int(c) < sizes_.drives) store(by, load(by) + load(bar_.input(2 * m + int(c))));
      if (back_.moves(drives_.player.cursor[c])) {
        back_.fill(int(c), drives_.player.cursor[c], step_.time, step_.length, by, result_.data);
      }
    }
  }

  // An output by state, drives and sources.
  void drives_back(int output, const Row& by) {
    output_back(*tables_, acting_.data() + smooth_.size(), acting_.size() - smooth_.size(), output, by, bar_);
  }

  void forces_back() {
    const int m = sizes_.feet;
    solved_.clear();
    forces_by_.clear();
    for (int i : smooth_) {
      solved_.push_back(smooth_input(step_, i));
      Row by = load(bar_.input(i));
      for (int o : step_.mode->free) {
        if (laws_.has(o, HAS_MOMENTUM) || laws_.has(o, HAS_FORCE) || integral_[o] == 0.0) continue;
        by += input_back(*tables_, o, i, by_gap_[o]);
      }
      forces_by_.push_back(by);
    }
    right_by_.resize(unknown_.size() * N);
    for (size_t a = 0; a < unknown_.size(); a++) {
      Row by = unknown_[a] < m ? by_gap_[unknown_[a]] : Row(0.0);
      for (size_t n = 0; n < solved_.size(); n++) {
        if (solved_[n].feels(unknown_[a], m)) by += solved_[n].by(unknown_[a], m) * forces_by_[n];
      }
      store(&right_by_[N * a], by);
    }
    if (!by_series()) {
      if (!factor_forces()) {
        result_.refused = true;
        return;
      }
      solver_.solve(right_by_.data());
      for (size_t n = 0; n < solved_.size(); n++) forces_by_[n] += outputs_back(solved_[n].input, right_by_);
    }
    for (size_t a = 0; a < unknown_.size(); a++) drives_back(unknown_[a], load(&right_by_[N * a]));
    for (size_t n = 0; n < solved_.size(); n++) laws_back(solved_[n], forces_by_[n]);
  }

  // What unknown outputs make of an input.
  Row outputs_back(int input, const std::vector<double>& by) const {
    Row sum = Row(0.0);
    for (size_t a = 0; a < unknown_.size(); a++) sum += input_back(*tables_, unknown_[a], input, load(&by[N * a]));
    return sum;
  }

  // Solve (1 - G S)^T mu = ``right_by_`` by the series mu = sum (S^T G^T)^n right, and add to the forces' what mu makes of them.
  // False, and nothing done, where its terms fall too slowly: most steps are so short that a few are enough.
  bool by_series() {
    const int m = sizes_.feet;
    series_ = term_ = right_by_;
    series_forces_.assign(solved_.size(), Row(0.0));
    double last = INF, least = 0.0;
    for (int count = 0; count < BACK_SERIES; count++) {
      next_term_.assign(term_.size(), 0.0);
      for (size_t n = 0; n < solved_.size(); n++) {
        const Row by = outputs_back(solved_[n].input, term_);
        series_forces_[n] += by;
        for (size_t a = 0; a < unknown_.size(); a++) {
          if (!solved_[n].feels(unknown_[a], m)) continue;
          store(&next_term_[N * a], load(&next_term_[N * a]) + solved_[n].by(unknown_[a], m) * by);
        }
      }
      Row largest = Row(0.0);
      for (size_t k = 0; k < term_.size(); k += N) {
        largest = larger(largest, magnitude(load(&next_term_[k])));
        store(&series_[k], load(&series_[k]) + load(&next_term_[k]));
      }
      const double size = highest(largest);
      if (count == 0) least = 1e-17 * std::max(size, highest_of(right_by_));
      if (!(size <= FALLING * last) || !std::isfinite(size)) return false;
      if (size <= least) {
        right_by_.swap(series_);
        for (size_t n = 0; n < solved_.size(); n++) forces_by_[n] += series_forces_[n];
        return true;
      }
      last = size;
      term_.swap(next_term_);
    }
    return false;
  }

  static double highest_of(const std::vector<double>& values) {
    double most = 0.0;
    for (double x : values) most = std::max(most, std::fabs(x));
    return most;
  }

  // A force at the nodes by the parameters of its laws and by its voltage.
  void laws_back(const Smooth& one, const Row& by) {
    const int m = sizes_.feet;
    const int64_t* groups = groups_.data() + size_t(one.foot) * laws_.laws.columns;
    const bool moves = std::any_of(groups, groups + laws_.laws.columns, [](int64_t g) { return g >= 0; });
    for (size_t n = 0; n < rates_.size() && (moves || (n == 0 && one.channel >= 0)); n++) {
      const int from = int(n) * (LANES - 1);
      rates_[n].each_term(one.hook(m), one.foot, one.arguments, one.count(m), [&](const Term& term, const Dual<Row, LANES>& found) {
        const Row own = select(is_finite(found.value), by, Row(0.0));
        const int last = std::min(laws_.laws.programs[term.program].parameters, from + LANES - 1);
        for (int k = from; k < last; k++) {
          const int64_t group = groups[term.first + k];
          if (group >= 0) result_.data.groups[group] += total(own * found.slope[k - from + 1]);
        }
        if (n > 0 || one.channel < 0) return;
        double* channel = &by_channel_[N * one.channel];
        store(channel, load(channel) + own * found.slope[0]);
      });
    }
  }
};

}  // namespace tarsus::modal

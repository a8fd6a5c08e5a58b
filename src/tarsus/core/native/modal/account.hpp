// Where the energy of a run goes, force by force, summed up step by step as it marches.
#pragma once
#include <numeric>

#include "modal/energies.hpp"

namespace tarsus::modal {

class Account {
 public:
  // Since the start of the run, and before its last step [J]: as `tarsus.core.arrays` has them, and of laws that act at once the work
  // of all but the last (see ActingLaws::shares), resistive ones first.
  std::vector<double> sums, before_step;

  explicit Account(Modal& m)
      : m_(m), legendre_(m.nodes), parts_(m.laws.shares()), resistive_(std::max(int(m.laws.laws.terms[MOMENTUM].size()) - 1, 0)),
        own_(ENERGIES + parts_), nodal_(m.sizes.feet, Row(0.0)), least_gap_(m.sizes.feet), largest_gap_(m.sizes.feet) {
    sums.resize(own_.size());
  }

  // A run begins, whose data have been taken.
  void begin(const RunData& run) {
    sums.assign(own_.size(), 0.0);
    before_step = sums;
    jumped_ = 0.0;
    std::fill(least_gap_.begin(), least_gap_.end(), INF);
    std::fill(largest_gap_.begin(), largest_gap_.end(), -INF);
    std::vector<double> sources(run.sources, run.sources + m_.sizes.sources());
    std::vector<int> columns = columns_of(run);
    if (sources == sources_ && columns == columns_) return;
    sources_ = std::move(sources);
    columns_ = std::move(columns);
    modes_.clear();
  }

  void add(const AcceptedStep& step) {
    note_gap_range(*step.mode);
    add_jumps(jumped_);
    ModeEnergies& energies = energies_of(*step.mode);
    z_.resize(energies.room());
    energies.fill(step, z_.data());
    fill_shares(step, energies);
    std::fill(own_.begin(), own_.end(), 0.0);
    energies.add(step.tables->number, step.fraction, z_.data(), shares_, resistive_, own_.data());
    before_step = sums;
    for (size_t e = 0; e < own_.size(); e++) sums[e] += e == RESISTIVE || e == FRICTION_WORK ? -own_[e] : own_[e];
    find_jumps(step);
  }

  // A run has ended. goes_on: the momenta of films are those of the gaps then, as if another step were to follow.
  void end(bool goes_on) {
    if (goes_on) add_jumps(jumped_);
  }

  // Between the lowest and the highest gap of each foot at the starts of steps [m].
  std::vector<double> gap_range() const {
    std::vector<double> out;
    for (size_t i = 0; i < least_gap_.size(); i++) out.push_back(std::max(largest_gap_[i] - least_gap_[i], 0.0));
    return out;
  }

 private:
  Modal& m_;
  const Legendre legendre_;
  const size_t parts_;
  const int resistive_;
  double jumped_ = 0.0;  // [J] work of momenta that jump at the end of the last step
  std::vector<int> columns_;
  std::vector<double> sources_, own_, z_;
  std::vector<Row> nodal_;
  Shares shares_;
  std::vector<double> least_gap_, largest_gap_;
  std::map<const ContactMode*, ModeEnergies> modes_;

  // Columns of each input (see ModeEnergies): of momenta and smooth forces where there are such laws; of drives that hold their values
  // between kinks one.
  std::vector<int> columns_of(const RunData& run) const {
    const Sizes& s = m_.sizes;
    const auto& terms = m_.laws.laws.terms;
    std::vector<int> out(s.inputs(), N);
    std::fill_n(out.begin(), s.feet, terms[MOMENTUM].empty() ? 0 : N);
    // friction, and the places of feet that stick, have the places of smooth forces
    std::fill_n(out.begin() + s.feet, s.feet, terms[FORCE].empty() && s.ways == 0 ? 0 : N);
    for (int d = 0; d < s.drives; d++) {
      const Signals& from = m_.player.signals;
      const int64_t channel = run.channels[d];
      const auto flat = from.flat.begin();
      if (std::all_of(flat + from.first[channel], flat + from.first[channel + 1], [](uint8_t one) { return one; })) out[2 * s.feet + d] = 1;
    }
    out[s.last()] = 1;
    return out;
  }

  ModeEnergies& energies_of(const ContactMode& mode) {
    return modes_.try_emplace(&mode, m_.book, mode, legendre_, sources_.data(), columns_).first->second;
  }

  void note_gap_range(const ContactMode& mode) {
    for (int i = 0; i < m_.sizes.feet; i++) {
      const double gap = mode.is_held[i] ? 0.0 : m_.outputs[i][0];
      least_gap_[i] = std::min(least_gap_[i], gap);
      largest_gap_[i] = std::max(largest_gap_[i], gap);
    }
  }

  // The inputs of the step law by law, where several laws act at once. The last law of a kind has the rest of their sum.
  void fill_shares(const AcceptedStep& step, const ModeEnergies& energies) {
    const ActingLaws& laws = m_.laws;
    const Row now = m_.nodes.times() * step.tables->length + step.begun;
    shares_.resize(parts_);
    for (size_t n = 0; n < parts_; n++) {
      const bool momenta = int(n) < resistive_;
      const Term& term = momenta ? laws.laws.terms[MOMENTUM][n] : laws.laws.terms[FORCE][n - resistive_];
      for (int i : step.mode->free) {
        const auto value = [&](const Row& gap) {
          return momenta ? laws.momentum_of(term, i, gap) : laws.force_of(term, i, gap, m_.outputs[m_.sizes.feet + i], m_.volts[i], now);
        };
        nodal_[i] = value(m_.outputs[i]);
        if (!finite(nodal_[i])) nodal_[i] = value(larger(m_.outputs[i], Row(0.0)));  // below the ground a law need not be defined
      }
      shares_[n].assign(N * step.mode->leading.size(), 0.0);
      energies.add_coefficients(nodal_.data(), momenta, shares_[n].data());
    }
  }

  // The work [J] of momenta that jump is dissipated by their laws, in the shares of the last step.
  void add_jumps(double work) {
    const double whole = own_[RESISTIVE];
    sums[RESISTIVE] -= work;
    for (int p = 0; p < resistive_ && whole != 0.0; p++) sums[ENERGIES + p] += own_[ENERGIES + p] * (work / whole);
  }

  // Momenta jump as a step begins, from what the gaps made of them at the end of the one before; and as it ends, from its
  // polynomials, which are those of the gaps at its nodes, to rounding, and less so between them.
  void find_jumps(const AcceptedStep& step) {
    const auto by_gap = [this](int i) { return m_.feet[i].momentum; };
    add_jumps(work_of_jumps(m_.ahead(), by_gap, [this](int i) { return m_.values[i][0]; }));
    for (int i : step.mode->free) {
      if (m_.laws.has(i, HAS_MOMENTUM)) m_.feet[i].momentum = m_.film(i, m_.gap_of(i));
    }
    jumped_ = work_of_jumps(m_.state(), [&](int i) { return m_.momentum_at(i, step.fraction); }, by_gap);
  }

  // Of jumps [J] at a flowing state: each at the mean of its foot's rates before and after, so that it equals the change of the
  // structure's energy.
  template <class Before, class After>
  double work_of_jumps(const double* state, const Before& before, const After& after) const {
    const ContactMode& mode = *m_.mode;
    const int ns = m_.sizes.state(), ni = m_.sizes.inputs();
    double work = 0.0;
    for (int i : mode.free) {
      if (!m_.laws.has(i, HAS_MOMENTUM)) continue;
      const size_t output = size_t(m_.sizes.feet + i);
      double rate = std::inner_product(state, state + ns, mode.outputs + output * ns, 0.0);
      for (int k : mode.free) {
        const double factor = mode.feed[output * ni + k];
        if (factor != 0.0 && m_.laws.has(k, HAS_MOMENTUM)) rate += factor * 0.5 * (before(k) + after(k));
      }
      work += (after(i) - before(i)) * rate;
    }
    return work;
  }
};

}  // namespace tarsus::modal

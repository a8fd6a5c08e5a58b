// What runs of any system share, from named arrays: nodes, signals, laws, settings.
#pragma once
#include <memory>
#include <utility>

#include "base/fields.hpp"
#include "base/nodes.hpp"
#include "drives/pieces.hpp"
#include "laws/laws.hpp"
#include "march/march.hpp"

namespace tarsus {

inline Nodes nodes_of(const Fields& from) {
  Nodes nodes;
  from.copy(nodes.tau, N, "TAU");
  from.copy(&nodes.monomial[0][0], N * N, "MONOMIAL");
  for (int j = 0; j < N; j++) {
    for (int c = 0; c < N; c++) nodes.from_value[j][c] = nodes.monomial[c][j];
  }
  from.copy(nodes.tail, N, "TAIL");
  // the power N - 1 of the scaled time has half of N - 1 times the power before it in its highest Legendre polynomial
  for (int j = 0; j < N; j++) nodes.tail_before[j] = (nodes.monomial[N - 2][j] + 0.5 * (N - 1) * nodes.monomial[N - 1][j]) / 924.0;  // (2 (N - 2) over N - 2)
  from.copy(&nodes.derivative[0][0], N * N, "DERIVATIVE");
  from.copy(&nodes.once[0][0], N * N, "ONCE");
  from.copy(&nodes.twice[0][0], N * N, "TWICE");
  from.copy(&nodes.left[0][0], N * N, "LEFT");
  from.copy(&nodes.right[0][0], N * N, "RIGHT");
  from.copy(&nodes.partial[0][0][0], N * N * N, "PARTIAL");
  nodes.spacing = from.number("SPACING");
  nodes.gauss = from.doubles("GAUSS");
  nodes.gauss_weights = from.sized("GAUSS_WEIGHTS", nodes.gauss.size());
  const std::vector<double> at_gauss = from.sized("AT_GAUSS", nodes.gauss.size() * N);
  for (int a = 0; a < N; a++) {
    for (double(&row)[N] : nodes.series) row[a] = 0.0;
    for (size_t g = 0; g < nodes.gauss.size(); g++) {
      double share = nodes.gauss_weights[g] * at_gauss[g * N + a];
      for (int n = 0; n < SERIES; n++) {
        nodes.series[n][a] += share;
        share *= (1.0 - nodes.gauss[g]) / (n + 1);
      }
    }
  }
  return nodes;
}

// Channels laid end to end: counts, loops (nc,); starts of each and its end (sum of counts + 1), coef (sum, 12), kink (sum,).
inline Signals signals_of(const Fields& from) {
  const std::vector<int64_t> count = from.integers("counts"), loop = from.integers("loops"), kink = from.integers("kink");
  const std::vector<double> start = from.doubles("starts"), coef = from.doubles("coef");
  const std::unique_ptr<bool[]> sharp(new bool[kink.size()]);
  std::copy(kink.begin(), kink.end(), sharp.get());
  size_t pieces = 0;
  for (int64_t n : count) pieces += size_t(n);
  Fields::check("a channel of a drive", loop.size() == count.size() && start.size() == pieces + count.size() &&
                                            coef.size() == DEGREE * pieces && kink.size() == pieces);
  Signals out;
  for (size_t c = 0, p = 0; c < count.size(); p += size_t(count[c++])) {
    if (count[c] < 1 || loop[c] >= count[c]) throw std::invalid_argument("a drive has a piece at least, and its loop begins with one");
    add_channel(out, {count[c], loop[c], start.data() + p + c, coef.data() + DEGREE * p, sharp.get() + p});
  }
  if (out.first.empty()) out.first.push_back(0);
  return out;
}

// flags, volts (m,); columns; terms (., 4): hook, twin, program, first column; scales (., 3): dimension, law, column; of the
// programs code (., 4), constants and sizes (2,): arguments, parameters.
inline Laws laws_of(const Fields& from) {
  Laws out;
  out.flags = from.integers("flags");
  out.volts = from.integers("volts");
  out.feet = int(out.flags.size());
  out.columns = int(from.whole("columns"));
  for (int64_t i = 0; from.has(std::to_string(i) + ".code"); i++) {
    const PartOf own(from, std::to_string(i) + ".");
    const auto code = own.narrowed<int32_t>("code");
    const auto constants = own.doubles("constants");
    const auto sizes = own.narrowed<int>("sizes");
    Fields::check("a program", sizes.size() == 2 && code.size() % 4 == 0);
    out.programs.push_back(link(code.data(), int(code.size() / 4), constants.data(), int(constants.size()), sizes[0], sizes[1]));
  }
  const auto terms = from.narrowed<int>("terms"), scales = from.narrowed<int>("scales");
  Fields::check("the terms of a law", terms.size() % 4 == 0 && scales.size() % 3 == 0);
  for (size_t i = 0; i < terms.size(); i += 4) {
    Fields::check("the terms of a law", terms[i] >= 0 && terms[i] < HOOKS);
    out.add(terms[i], {terms[i + 1], terms[i + 2], terms[i + 3]});
  }
  for (size_t i = 0; i < scales.size(); i += 3) {
    Fields::check("the scales of a law", scales[i + 2] >= 0 && scales[i + 2] < out.columns);
    const bool goes_on = i > 0 && scales[i] == scales[i - 3] && scales[i + 1] == scales[i - 2];
    if (!goes_on) out.scales.push_back({scales[i], {}});
    out.scales.back().columns.push_back(scales[i + 2]);
  }
  return out;
}

inline Settings settings_of(const Fields& from) {
  Settings out;
  const std::pair<double*, const char*> sizes[] = {
      {&out.end, "end"}, {&out.period, "period"}, {&out.gap, "gap"}, {&out.drive, "drive"}, {&out.gap_zero, "gap_zero"},
      {&out.force_zero, "force_zero"}, {&out.speed_zero, "speed_zero"}, {&out.rest_height, "rest_height"},
      {&out.least_flight, "least_flight"}, {&out.least_progress, "least_progress"}, {&out.probe, "probe"}};
  for (const auto& [to, name] : sizes) *to = from.number(name);
  out.most_steps = from.whole("most_steps");
  out.first_class = from.whole("first_class");
  out.track = from.whole("track") != 0;
  return out;
}

}  // namespace tarsus

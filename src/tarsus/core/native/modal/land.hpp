// The first event inside a step and the state there, from Taylor polynomials in the scaled time s of the step.
//
// Their coefficients come straight from tables: rows c (T / rate)^j for what the state gives, Markov parameters for what
// the inputs give, both scaled by (rate h)^j / j!.
#pragma once
#include "modal/scan.hpp"

namespace tarsus::modal {

// Inputs by powers of s, and those times j! / ((rate h)^j rate).
inline void scale_inputs(Modal& m, const StepClass& step) {
  const Row share = load(step.share);
  m.degree = 1;
  for (int i : m.inputs) {
    Row power = Row(0.0);
    if (m.constant[i]) {
      power.set(0, m.value(i)[0]);
    } else {
      power = powers_of(m.nodes, m.value(i));
      m.degree = N;
    }
    m.powers[i] = power;
    m.shares[i] = power * share;
  }
}

// line[c] = coefficient of s^c of an output, for c < 8 rows; zero behind.
inline void expand_output(Modal& m, const StepClass& step, int output, int rows, double* line) {
  const ContactMode& mode = *m.mode;
  const int ns = m.sizes.stride, ni = m.sizes.inputs();
  const double *w = m.state(), *ladder = mode.ladder + output * 2 * ns * TERMS;
  Row sum[TERMS / N];
  for (int v = 0; v < rows; v++) {
    Row even = load(m.bias->markov + output * MARKOV + BEFORE - 1 + N * v) * step.share[0], odd = Row(0.0);
    for (int b = 0; b < mode.blocks_used; b++) {
      even += load(ladder + 2 * b * TERMS + N * v) * w[b];
      odd += load(ladder + (2 * b + 1) * TERMS + N * v) * w[ns + b];
    }
    for (int i : m.inputs) {
      const double* markov = mode.markov + (output * ni + i) * MARKOV + BEFORE - 1 + N * v;
      const double* share = reinterpret_cast<const double*>(&m.shares[i]);
      if (m.constant[i]) {
        even += load(markov) * share[0];
        continue;
      }
      for (int c = 0; c < N; c += 2) {
        even += load(markov - c) * share[c];
        odd += load(markov - c - 1) * share[c + 1];
      }
    }
    sum[v] = (even + odd) * load(step.growth + N * v);
  }
  Row direct = Row(0.0);
  direct.set(0, m.bias->feed[output]);
  sum[0] += direct;
  for (int i : m.inputs) {
    const double feed = mode.feed[output * ni + i], rate = mode.feed_rate[output * ni + i] / step.length;
    if (feed != 0.0) sum[0] += m.powers[i] * feed;
    if (rate == 0.0) continue;
    Row slope = Row(0.0);
    for (int c = 0; c < N - 1; c++) slope.set(c, rate * (c + 1.0) * m.powers[i][c + 1]);
    sum[0] += slope;
  }
  for (int v = 0; v < rows; v++) store(line + N * v, sum[v]);
  store(line + N * rows, Row(0.0));
}

// 1, x, x^2, ... x^7: by one, two and four places of a row at once, which need not go through memory.
TARSUS_INLINE Row powers_to_seven(double x) {
  alignas(64) static constexpr double ONE[N] = {0, 1, 0, 1, 0, 1, 0, 1}, TWO[N] = {0, 0, 1, 1, 0, 0, 1, 1};
  alignas(64) static constexpr double FOUR[N] = {0, 0, 0, 0, 1, 1, 1, 1};
  const double x2 = x * x, x4 = x2 * x2;
  const Row one = load(ONE), two = load(TWO), four = load(FOUR);
  return (one * x + (1.0 - one)) * (two * x2 + (1.0 - two)) * (four * x4 + (1.0 - four));
}

// The margin of one event as a function of s on the present step: an output, or for a held foot the strength that holds it less an
// output.
struct Margin {
  const Modal& m;
  int event, foot, rows;
  bool held, slips, straight;  // slips: friction holds it; straight: what holds it grows linearly with time
  double t, h, at_start = 0.0, gain = 0.0;

  Margin(const Modal& modal, const StepClass& step, int number, double time, int terms)
      : m(modal), event(number), foot(event % m.sizes.feet), rows((terms + N - 1) / N),
        held(bears(m, event)), slips(held && event >= m.sizes.feet),
        straight(!slips && !m.laws.has(foot, HAS_FORCE) && m.laws.linear_strength()), t(time), h(step.length) {
    if (!held || !straight) return;
    at_start = m.laws.strength(foot, t - m.feet[foot].since, 0.0);
    gain = m.laws.strength(foot, t + h - m.feet[foot].since, 0.0) - at_start;
  }

  // The output over s^first, and its slope.
  TARSUS_INLINE double output(int first, double s) const { return value_of(m.line + first, s); }
  TARSUS_INLINE double value_of(const double* line, double s) const {
    const Row p = powers_to_seven(s);
    const double s8 = p[N - 1] * s;
    Row f = load(line + N * (rows - 1));
    for (int v = rows - 2; v >= 0; v--) f = f * s8 + load(line + N * v);
    return total(f * p);
  }
  TARSUS_INLINE double output(int first, double s, double& slope) const {
    static const double RAMP[N] = {1, 2, 3, 4, 5, 6, 7, 8};
    const Row p = powers_to_seven(s), ramp = load(RAMP);
    const double s8 = p[N - 1] * s, *line = m.line + first;
    Row f = load(line + N * (rows - 1)), d = load(line + N * (rows - 1) + 1) * (ramp + double(N) * (rows - 1));
    for (int v = rows - 2; v >= 0; v--) {
      f = f * s8 + load(line + N * v);
      d = d * s8 + load(line + N * v + 1) * (ramp + double(N) * v);
    }
    slope = total(d * p);
    return total(f * p);
  }

  double holds(double s) const {
    if (straight) return at_start + gain * s;
    const double* powers = reinterpret_cast<const double*>(&m.volt_powers[foot]);
    const double volts = m.laws.laws.volts[foot] >= 0 ? horner(powers, 0, N, s) : 0.0, breaking = breaking_pull(m, foot, t + s * h, volts);
    if (!slips) return breaking;
    return m.laws.friction(foot, breaking - value_of(m.pull_line, s), m.laws.strength(foot, t + s * h - m.feet[foot].since, volts), 0.0);
  }
  double operator()(int first, double s) const { return held ? holds(s) - output(first, s) : output(first, s); }
  // The slope of the strength that holds a foot is taken by a central difference.
  double slope(int first, double s) const {
    double out;
    output(first, s, out);
    if (!held) return out;
    if (straight) return gain - out;
    const double d = 1e-5;
    return (holds(s + d) - holds(s - d)) / (2.0 * d) - out;
  }

  // Where a cubic of s over f through four nodes about interval j puts the zero.
  double guess(int j) const {
    const int k = std::min(std::max(j - 2, 0), N - 4);
    const double *tau = m.nodes.tau + k, *f = reinterpret_cast<const double*>(&m.margin[event]) + k;
    const double d01 = f[0] - f[1], d02 = f[0] - f[2], d03 = f[0] - f[3], d12 = f[1] - f[2], d13 = f[1] - f[3], d23 = f[2] - f[3];
    const double f01 = f[0] * f[1], f23 = f[2] * f[3];
    const double sum = f23 * d23 * (tau[1] * f[0] * d02 * d03 - tau[0] * f[1] * d12 * d13) +
                       f01 * d01 * (tau[3] * f[2] * d02 * d12 - tau[2] * f[3] * d03 * d13);
    return sum / (d01 * d02 * d03 * d12 * d13 * d23);
  }

  // Zero in [a, b], f(a) > 0 > f(b): Newton's method kept inside the bracket. The strength against the pull hardly bends within
  // the bracket, unless volts command it: its slope is that of its chord.
  double root(int first, double a, double b, double fa, double fb, double guess) const {
    const bool bends = held && m.laws.commanded();
    const double chord = !held ? 0.0 : straight ? gain : (holds(b) - holds(a)) / (b - a);
    double s = a < guess && guess < b ? guess : b - fb * (b - a) / (fb - fa), last = 1.0;
    for (int n = 0; n < 80; n++) {
      double slope, f = output(first, s, slope);
      if (held) {
        f = holds(s) - f;
        slope = bends ? this->slope(first, s) : chord - slope;
      }
      (f > 0.0 ? a : b) = s;
      double after = s - f / slope;
      if (!(a <= after && after <= b)) after = 0.5 * (a + b);
      const double change = std::fabs(after - s);
      // the rounding of the polynomial; or convergence is quadratic, and the next change would be (change / last)^2 of this
      const bool converged = change <= 1e-15 * b || (change < 1e-10 && change > 0.25 * last);
      const bool quadratic = !bends && last < 1e-2 && change < 1e-2 * last;
      if (converged || (quadratic && change * change * change <= 1e-17 * last * last)) return after;
      last = change;
      s = after;
    }
    return b;
  }

  // Time and value of the minimum inside [a, b], in place of b and f(b); f = inf where there is none.
  void interior_minimum(int first, double a, double& b, double& value) const {
    double high = b, fa = slope(first, a), fb = fa < 0.0 ? slope(first, high) : 0.0;
    value = INF;
    if (!(fa < 0.0 && 0.0 < fb)) return;
    double s = high;
    for (int n = 0; n < 40; n++) {
      s = high - fb * (high - a) / (fb - fa);
      if (n % 3 == 2 || !(a < s && s < high)) s = 0.5 * (a + high);
      const double f = slope(first, s);
      if (f == 0.0 || high - a < 1e-12) break;
      if (f < 0.0) {
        a = s;
        fa = f;
      } else {
        high = s;
        fb = f;
      }
    }
    b = s;
    value = (*this)(first, s);
  }

  // Lowest power of s, ``from`` at least, in the rise of a foot released at s = 0: a coefficient at rounding level of the
  // others counts as zero. Where the pull has only just exceeded the strength there is no acceleration at first: the foot rises
  // with s^3.
  int lowest_power(int from, int terms, double b) const {
    int first = from;
    double size = 0.0, power = 1.0;
    for (int c = first; c < std::min(first + 6, terms); c++) {
      size = std::max(size, std::fabs(m.line[c]) * power);
      power *= b;
    }
    power = 1e-6 * size;
    while (first < from + 2 && std::fabs(m.line[first]) <= power) {
      first++;
      power /= b;
    }
    return first;
  }

  // First s in (0, limit] at which the foot has its event, or 2 if there is none: looks at the doubtful node intervals,
  // with the interior minimum where the slope turns.
  double first_root(const UnresolvedRoot& interval, double limit, double zero, int terms) const {
    const double* tau = m.nodes.tau;
    for (int j = interval.first; j <= interval.last; j++) {
      const double a = tau[j - 1];
      if (a >= limit) break;
      double fa = m.margin[event][j - 1], b = tau[j], fb = m.margin[event][j];
      if (held && fa < -zero) return a;
      if (b > limit) {
        b = limit;
        fb = (*this)(0, b);
      }
      // a foot that left the ground at s = 0 comes back at the first zero of f(s) / s^first
      const bool along = event >= m.sizes.feet;
      int first = j == 1 && !held ? std::max(along ? m.feet[foot].slide : m.feet[foot].departure, 0) : 0;
      if (first == FROM_REST) first = along ? lowest_power(1, terms, b) : lowest_power(2, terms, b);
      if (fb >= -zero) {
        interior_minimum(first, a, b, fb);
        for (int c = 0; c < first; c++) fb *= b;
      }
      if (!(fb < -zero)) continue;
      if (first > 0) {
        fa = m.line[first];  // where that is negative the foot never rises
        fb = output(first, b);
        if (fb >= 0.0) return b;
      }
      return fa <= 0.0 ? a : root(first, a, b, fa, fb, first == 0 ? guess(j) : 2.0);
    }
    return 2.0;
  }
};

// The first event before ``limit``, its foot and its scaled time; -1 where there is none.
struct Located {
  int foot = -1, event = -1;
  double s = 2.0;
};

// The margin's output along the ground, in the direction in which the foot slides or is pulled.
TARSUS_APART inline void expand_along(Modal& m, const StepClass& step, const Margin& margin) {
  const int feet = m.sizes.feet, foot = margin.foot;
  expand_output(m, step, feet + foot, margin.rows, m.line);
  if (margin.slips) expand_output(m, step, foot, margin.rows, m.pull_line);
  const double sign = !margin.slips ? m.feet[foot].sense : margin.event < 2 * feet ? 1.0 : -1.0;
  for (int c = 0; c < N * margin.rows; c++) m.line[c] *= sign;
}

TARSUS_INLINE Margin expanded(Modal& m, const StepClass& step, int event, double t, int terms) {
  const Margin margin(m, step, event, t, terms);
  const int foot = margin.foot;
  if (event < m.sizes.feet) {
    expand_output(m, step, foot, margin.rows, m.line);
  } else {
    expand_along(m, step, margin);
  }
  if (margin.held && m.laws.laws.volts[foot] >= 0) {
    powers_of(m.nodes, reinterpret_cast<const double*>(&m.volts[foot]), reinterpret_cast<double*>(&m.volt_powers[foot]));
  }
  return margin;
}

// The events that come with the one that is located first: their margins are zero, within rounding, or below, at its time.
TARSUS_APART inline void find_simultaneous(Modal& m, const StepClass& step, double t, const Located& at, int terms) {
  constexpr double APART = 1e-6;  // part of a step: events farther apart are not simultaneous
  for (int e = 0; e < m.events(); e++) {
    if (e == at.event || m.unresolved[e].last == 0 || m.unresolved[e].at - at.s > APART) continue;
    if (expanded(m, step, e, t, terms)(0, at.s) <= m.unresolved[e].zero) m.happening.push_back(e);
  }
}

// Whether there is no force along the ground by which a foot could slide: the friction bound passes 0 because the foot is about to
// leave.
inline bool nothing_along(const Modal& m, const Margin& margin, double s) {
  return std::fabs(margin.output(0, s)) <= no_margin(m, margin.foot) + ROUNDING * m.force_parts(m.sizes.feet + margin.foot);
}

inline Located locate(Modal& m, const StepClass& step, double t, double limit, int terms) {
  Located out;
  int found = 0;
  for (int i = 0, events = m.events(); i < events; i++) {
    UnresolvedRoot& root = m.unresolved[i];
    if (root.last == 0) continue;
    if (root.zero == 0.0) root.zero = no_event(m, i);
    const Margin margin = expanded(m, step, i, t, terms);
    const double s = root.at = margin.first_root(root, limit, root.zero, terms);
    if (s > limit) continue;
    if (margin.slips && nothing_along(m, margin, s) && size_of(m.margin[m.sizes.feet + margin.foot] + m.margin[2 * m.sizes.feet + margin.foot]) > 0.0) {
      root.last = 0;
      continue;
    }
    found++;
    if (s < out.s) out = {margin.foot, i, s};
  }
  m.happening.assign(found > 0, out.event);
  if (found > 1) find_simultaneous(m, step, t, out, terms);
  return out;
}

// State at scaled time s, into ``ahead``: w' = T w + inputs by its derivatives while inputs come in, powers of T behind.
// Returns whether all of it is finite.
template <class S>
TARSUS_APART bool state_at(Modal& m, const StepClass& step, int terms, double s) {
  const ContactMode& mode = *m.mode;
  const int ns = S::stride(m.sizes.stride), size = 2 * ns, rows = (terms + N - 1) / N;
  Row power = powers_to_seven(s);
  const double s8 = power[N - 1] * s;
  for (int v = 0; v < rows; v++) {
    store(m.scaled_times + N * v, power * load(step.growth + N * v));
    power *= s8;
  }
  const double *e = m.scaled_times, *first_power = mode.powers + 4 * ns, *w = m.state();
  typename S::Pack zero = {};
  for (int p = 0; p < S::packs(ns); p++) {
    const int at = p * S::WIDTH;
    typename S::Pack x = S::get(w + at), y = S::get(w + ns + at), u, v;
    typename S::Pack sum_x = x * e[0], sum_y = y * e[0];
    for (int c = 0; c < m.degree; c++) {
      turn<S>(first_power, ns, p, x, y, u, v);
      if (c == 0) {
        u += S::get(m.bias->inputs + at) * step.share[0];
        v += S::get(m.bias->inputs + ns + at) * step.share[0];
      }
      for (int i : m.inputs) {
        if (c > 0 && m.constant[i]) continue;
        const double share = m.shares[i][c];
        u += S::get(mode.inputs + i * size + at) * share;
        v += S::get(mode.inputs + i * size + ns + at) * share;
      }
      x = u;
      y = v;
      sum_x += x * e[c + 1];
      sum_y += y * e[c + 1];
    }
    typename S::Pack even[4] = {}, odd[4] = {};
    const double* matrix = mode.powers + 4 * ns + at;
    int c = m.degree + 1;
    for (; c + 1 < N * rows; c += 2, matrix += 8 * ns) {
      for (int k = 0; k < 4; k++) {
        even[k] += S::get(matrix + k * ns) * e[c];
        odd[k] += S::get(matrix + (4 + k) * ns) * e[c + 1];
      }
    }
    for (int k = 0; k < 4 && c < N * rows; k++) even[k] += S::get(matrix + k * ns) * e[c];
    sum_x += (even[0] + odd[0]) * x + (even[1] + odd[1]) * y;
    sum_y += (even[2] + odd[2]) * x + (even[3] + odd[3]) * y;
    S::put(m.ahead() + at, sum_x);
    S::put(m.ahead() + ns + at, sum_y);
    zero += (sum_x + sum_y) * 0.0;
  }
  return S::sum(zero) == 0.0;
}

}  // namespace tarsus::modal

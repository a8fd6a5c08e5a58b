// A step of a whole walker of few legs: linear but for what the laws do to feet in the air and to sliding ones.
//
// Gaps and pulls at the nodes are the step's columns (legged/whole_tables.hpp) times state, drives and forces of the laws. The forces
// are repeated until they agree with the motion they make; one of Newton's steps takes the place of that where a film is stiff.
#pragma once
#include "legged/march.hpp"

namespace tarsus::legged {

// Of more legs the contact states are many, and rounding would tell legs apart that are alike and move alike.
constexpr int FEW_LEGS = 2;
constexpr int MOST_WIDTH = 16;   // machine rows of a column
constexpr int MOST_INPUTS = 64;  // gravity, drives and slots
constexpr int WHOLE_ROWS = MOST_WHOLE / N;
// A film that changes the gap by more than this share of what changes the film is solved by Newton's method: a sweep leaves a third.
constexpr double STIFF_WHOLE = 0.3;
// The polynomial through the nodes misses (L_8 - L_6) of Legendre's polynomials for each L_8 in a force; its integral, which moves the
// foot, is no more than 0.0391 of what a constant one's is over the step, and nothing at its end.
constexpr double MISSED = 0.04;

// A walker as a whole, and the step being made of it.
struct Whole : LeggedMarch {
  const std::shared_ptr<const WholeTables> whole;
  const WholeLayout layout;
  int state = 0;                     // contact state, see WholeTables
  alignas(64) double y[MOST_WHOLE + MOST_INPUTS] = {};  // at the start of the step, and inputs that are constant in it
  Row linear[MOST_WIDTH], seen[MOST_WIDTH];  // outputs at the nodes and state at the end: without the laws' forces, and with them
  Row force[MOST_INPUTS];            // of the laws at the nodes, by slot
  bool acts[MOST_INPUTS];            // which of them there are
  bool level[MOST_INPUTS];           // which drives are constant
  double growth = 1.0;               // of the film that limits the step, from its start to its end
  const bool film_alone = laws.film_alone();

  template <class... Given>
  Whole(std::shared_ptr<const WholeTables> of, Given&&... given) : LeggedMarch(given...), whole(std::move(of)), layout(body) {}

  static bool serves(const Body& body) {
    const WholeLayout layout(body);
    return layout.legs <= FEW_LEGS && layout.size <= MOST_WHOLE && layout.inputs <= MOST_INPUTS && layout.width <= MOST_WIDTH;
  }

  const WholeStep& step_of(int k) const { return whole->of(state, k); }

  // Where the step starts, and in which contact state.
  void enter_step() {
    state = 0;
    for (int i = legs() - 1; i >= 0; i--) state = CONTACTS * state + int(feet[i].contact);
    for (int b = 0; b < coordinates(); b++) {
      y[layout.x(b)] = x[b];
      y[layout.v(b)] = v[b];
    }
    for (int i = 0; i < legs(); i++) {
      const LeggedFoot& foot = feet[i];
      for (int d = 0; d < DIRECTIONS; d++) {
        y[layout.u(i, d)] = foot.u[d];
        y[layout.w(i, d)] = foot.held(d) ? 0.0 : foot.w[d];
      }
      acts[layout.slot(i, 0)] = foot.filmed() || (foot.contact == SLIPPING && foot.sense != 0.0);
      acts[layout.slot(i, 1)] = foot.contact == AIR && foot.force;
    }
  }

  // out += sum of columns times values, ``count`` of them one after the other.
  template <int GROUP>
  TARSUS_INLINE void add_group(const Row* from, const double* by, int count, Row* out) const {
    Row sum[GROUP];
    for (int r = 0; r < GROUP; r++) sum[r] = out[r];
    for (int c = 0; c < count; c++, from += layout.width) {
      for (int r = 0; r < GROUP; r++) sum[r] += from[r] * by[c];
    }
    for (int r = 0; r < GROUP; r++) out[r] = sum[r];
  }
  void add_columns(const WholeStep& step, int first, const double* by, int count, Row* out) const {
    const Row* from = &step.column[first * layout.width];
    if (layout.width == 8) return add_group<8>(from, by, count, out);
    for (int g = 0; g < layout.width; g += 4) add_group<4>(from + g, by, count, out + g);
  }

  // Outputs without the forces of the laws.
  void flow(const WholeStep& step, double h) {
    double* constant = y + layout.size;
    constant[0] = gravity;
    for (int c = 0; c < player.channels(); c++) {  // drives, then volts of electrodes
      const bool flat = player.fill(c, clock.time, h, reinterpret_cast<double*>(&channels[c]));
      if (c >= layout.drives) continue;
      level[c] = flat;
      constant[1 + c] = flat ? channels[c][0] : 0.0;
    }
    for (int r = 0; r < layout.width; r++) linear[r] = Row(0.0);
    add_columns(step, 0, y, layout.size + layout.first_slot, linear);
    for (int d = 0; d < layout.drives; d++) {
      if (!level[d]) add_columns(step, layout.nodal(layout.drive(d)), reinterpret_cast<const double*>(&channels[d]), N, linear);
    }
  }

  // The first output of a leg under the present forces of the laws but for one of them.
  TARSUS_INLINE Row output(const WholeStep& step, int i, int but) const {
    const Row* effect = &step.effect[i * SLOTS * layout.legs * N];
    Row sum = linear[layout.seen(i, 0)];
    for (int b = layout.first_slot; b < layout.inputs; b++, effect += N) {
      if (acts[b] && b != but) sum += combine(reinterpret_cast<const double*>(effect), force[b]);
    }
    return sum;
  }

  // The film's momentum at a foot in the air from its gap in the rows; ``share``: how far it changes the gap at most for each change of
  // the gap. False where it is too stiff to be repeated.
  TARSUS_INLINE bool soft_film(int i, double reach, double& share) {
    LegRows& r = rows[i];
    const int f = body.legs[i].foot;
    if (!film_alone) {
      share = std::fabs(laws.momentum_slope(f, lowest(r.gap), settings.probe)) * reach;
      if (!(share < STIFF_WHOLE)) return false;
      r.film = film(i, r.gap);
      return true;
    }
    // as film_momentum_from, and the slope -C / (g + g0)^3
    const double* p = laws.of(f, laws.laws.terms[MOMENTUM][0]);
    const LeggedFoot& foot = feet[i];
    Row inverse, scaled;
    reciprocals(r.gap + p[1], Row(p[0] * reach), inverse, scaled);
    const Row square = inverse * inverse;
    share = highest(scaled * square);
    if (any_not_below(scaled * square, Row(STIFF_WHOLE))) return false;
    r.film = (foot.from - r.gap) * (r.gap + (foot.from + 2.0 * p[1])) * (square * foot.base);
    return !any_less(inverse, Row(0.0));
  }

  // The same, or by Newton's method, as a force. Returns how far the foot would move that this still has to follow: what the change of
  // the momentum moves it by, times the share of that which changes the momentum again.
  TARSUS_INLINE double film_in_air(const WholeStep& step, int i, bool& failed) {
    const int slot = layout.slot(i, 0);
    LegRows& r = rows[i];
    double change = 0.0, share = 1.0;
    if (soft_film(i, step.reach[slot], share)) {
      change = highest(magnitude(r.film - force[slot])) * step.reach[slot] * share;
    } else {
      const Row before = r.gap, alone = output(step, i, slot) + body.legs[i].gap;
      const int row = i * SLOTS * layout.legs + slot - layout.first_slot;
      failed = failed || !stiff_film(*this, reinterpret_cast<const double*>(&step.effect[row * N]), i, alone, r);
      change = highest(magnitude(r.gap - before));
    }
    force[slot] = r.film;
    return change;
  }

  // The film's momentum and the smooth force at a foot in the air from its motion in the rows. Returns how far they would move it.
  TARSUS_INLINE double forces_in_air(const WholeStep& step, int i, double h, bool& failed) {
    double change = feet[i].film ? film_in_air(step, i, failed) : 0.0;
    if (!feet[i].force) return change;
    const int slot = layout.slot(i, 1), f = body.legs[i].foot;
    LegRows& r = rows[i];
    if (laws.has(f, USES_RATE)) find_rate(step, i);
    r.smooth = laws.force(f, r.gap, r.rate, volts(f), nodes.times() * h + clock.time);
    change += highest(magnitude(r.smooth - force[slot])) * step.reach[slot];
    force[slot] = r.smooth;
    return change;
  }

  void find_rate(const WholeStep& step, int i) {
    LegRows& r = rows[i];
    r.rate = linear[layout.seen(i, 1)];
    for (int b = layout.first_slot; b < layout.inputs; b++) {
      for (int j = 0; acts[b] && j < N; j++) r.rate += step.column[(layout.nodal(b) + j) * layout.width + layout.seen(i, 1)] * force[b][j];
    }
    if (feet[i].film) r.rate += r.film * (1.0 / body.legs[i].mass);
  }

  // The friction of a sliding foot.
  double friction_of(const WholeStep& step, int i) {
    const int slot = layout.slot(i, 0);
    LegRows& r = rows[i];
    r.bound = laws.friction(body.legs[i].foot, r.margin, r.strength, Row(0.0));
    const Row now = r.bound * -feet[i].sense;
    const double change = highest(magnitude(now - force[slot])) * step.reach[slot];
    force[slot] = now;
    return change;
  }

  // Repeat the forces of the laws until they agree with the motion: the number of sweeps, or -1.
  int settle(const WholeStep& step, double h) {
    const double tolerance = SETTLED * settings.gap;
    double before = INF;
    for (int b = layout.first_slot; b < layout.inputs; b++) force[b] = Row(0.0);
    for (int i : body.leg) {
      LegRows& r = rows[i];
      if (feet[i].contact == AIR) {
        r.gap = linear[layout.seen(i, 0)] + body.legs[i].gap;
        r.rate = linear[layout.seen(i, 1)];
      } else {
        held_strength(*this, i, h);
        r.margin = r.smooth - linear[layout.seen(i, 0)];
      }
    }
    for (int n = 0; n < SWEEPS; n++) {
      double change = 0.0;
      bool failed = false;
      for (int i : body.leg) {
        if (feet[i].contact == AIR) change = std::max(change, forces_in_air(step, i, h, failed));
        if (acts[layout.slot(i, 0)] && feet[i].contact == SLIPPING) change = std::max(change, friction_of(step, i));
      }
      if (failed || (n > 6 && change > 0.8 * before)) return -1;
      if (change <= tolerance) return n + 1;
      if (!(change < INF)) return -2;
      for (int i : body.leg) {
        if (feet[i].contact == AIR && (feet[i].film || feet[i].force)) {
          rows[i].gap = output(step, i, -1) + body.legs[i].gap;
        } else if (feet[i].contact == SLIPPING) {
          rows[i].margin = rows[i].smooth - output(step, i, -1);
        }
      }
      before = change;
    }
    return -1;
  }

  // Everything seen of the step, and its end.
  bool finish(const WholeStep& step) {
    for (int r = 0; r < layout.width; r++) seen[r] = linear[r];
    for (int b = layout.first_slot; b < layout.inputs; b++) {
      if (acts[b]) add_columns(step, layout.nodal(b), reinterpret_cast<const double*>(&force[b]), N, seen);
    }
    Row sum = Row(0.0);
    for (int i : body.leg) {
      const Row &one = seen[layout.seen(i, 0)], &other = seen[layout.seen(i, 1)];
      LegRows& r = rows[i];
      if (feet[i].contact == AIR) {
        r.gap = one + body.legs[i].gap;
        r.rate = feet[i].film ? other + r.film * (1.0 / body.legs[i].mass) : other;
        sum += r.gap + r.rate;
      } else {
        r.margin = r.smooth - one;
        (feet[i].contact == STUCK ? r.along : r.w[ALONG]) = other;
        sum += r.margin + other;
      }
    }
    at.x[1] = seen[layout.height(0)];
    at.v[1] = seen[layout.height(1)];
    return finite(sum + at.x[1] + at.v[1]);
  }

  // Truncation of a step over its tolerance: of what the laws and the drives do to the feet.
  double whole_error(const WholeStep& step) {
    growth = 1.0;
    double worst = 0.0, drives = 0.0, driven = 0.0;
    for (int d = 0; d < layout.drives; d++) {
      if (level[d]) continue;
      const double missed = nodes.truncation(channels[d]), span = player.cursor[d].span;
      driven += missed * MISSED * step.reach[layout.drive(d)];
      if (span > 0.0) drives = std::max(drives, missed / span / settings.drive);
    }
    for (int i : body.leg) {
      const LegRows& r = rows[i];
      double error = driven;
      for (int n = 0; n < SLOTS; n++) {
        const int slot = layout.slot(i, n);
        if (!acts[slot]) continue;
        const double reach = MISSED * step.reach[slot];
        double missed = nodes.truncation(force[slot]) * reach;
        if (n == 0 && feet[i].contact == AIR) {
          // a stiff film holds the gap: an error of its momentum moves it no more than the film's slope lets it
          const double swing = std::fabs(r.gap[N - 1] - r.gap[0]), change = std::fabs(r.film[N - 1] - r.film[0]);
          if (swing > 0.0) missed /= 1.0 + reach * change / swing;
        }
        error += missed;
      }
      if (error > worst && feet[i].filmed()) growth = std::fabs((feet[i].base + r.film[N - 1]) / feet[i].base);
      worst = std::max(worst, error);
    }
    return std::max(worst / settings.gap, drives);
  }

  Attempt try_whole(int k) {
    const double h = tables.lengths[k];
    const WholeStep& step = step_of(k);
    flow(step, h);
    const int sweeps = settle(step, h);
    if (sweeps < 0) return {sweeps == -1 ? UNSETTLED : UNDEFINED, SWEEPS};
    if (!finish(step)) return {UNDEFINED, sweeps};
    return {whole_error(step), sweeps};
  }

  // First step class in which the nodes see what events are looked for in: the gaps of feet that are all in the air, and else every free
  // leg's own oscillation and that of the body on its feet.
  int coarsest_whole() const {
    if (state == 0) {
      int k = 0;
      for (int i = 0; i < legs(); i++) k = std::max(k, tables.longest[body.legs[i].kind[UP]]);
      return k;
    }
    int k = coarsest();
    const double most = OSCILLATION / std::max(whole->state(state).system.sway, 1e-300);
    while (k + 1 < tables.classes() && tables.lengths[k] > most) k++;
    return k;
  }
};

}  // namespace tarsus::legged

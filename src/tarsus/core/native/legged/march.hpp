// A legged robot under the one march: a step to its end or to the first event inside it; marks and samples on
// the way.
#pragma once
#include "legged/account.hpp"
#include "legged/ground.hpp"
#include "legged/step.hpp"
#include "march/peak.hpp"

namespace tarsus::legged {

// The error of a step falls by 2^ORDER when its length is halved: the highest coefficient of a polynomial of degree 7 by 2^7, and
// the displacement that it causes by 2 at least.
constexpr int ORDER = N;
// Part of the tolerance at which the error of the next step aims: a factor of two below it, since errors change from step to step.
constexpr double AIM = 0.5;
constexpr int MOST_LONGER = 4;  // classes at once: an error that would allow more is rounding and determines nothing
// Sweeps of a step above which the next is shorter, and up to which it may be longer: parts of those that a step may take.
constexpr int MANY_SWEEPS = MOST_SWEEPS / 2, FEW_SWEEPS = MOST_SWEEPS / 3;

// Classes by which a step that was refused for that error, over its tolerance, is to be shorter; negative: it had none.
inline int classes_down(double error) {
  int down = 1;
  while (std::ldexp(1.0, ORDER * down) < error && std::isfinite(error)) down++;
  return down;
}

// Classes by which a step with that error might have been longer.
inline int classes_up(double error) {
  int up = 0;
  while (up < MOST_LONGER && std::ldexp(error, ORDER * (up + 1)) < AIM) up++;
  return up;
}

// What is noted on the way in addition to events: marks (time; body; per foot place along the way and path slid;
// lowest and highest of the body since the last mark), and samples at given times (see LeggedMarch::sample).
struct Notes {
  std::vector<double> marks;
  std::vector<double> times;  // [s], increasing
  std::vector<double> samples;
  size_t sampled = 0;

  // Ask for samples, rows of ``width``, at other times; what is not reached stays not a number.
  void ask(const double* at, size_t count, size_t width) {
    times.assign(at, at + count);
    samples.assign(count * width, NOT_A_NUMBER);
  }
};

struct LeggedMarch : Legged {
  const bool keeps_account;
  const Body& unit_body;  // its weights are those of unit gravity
  Notes& notes;
  std::vector<Profile> ground;
  Moment moment;
  const double* gravity = nullptr;  // [m/s^2] of the run, into the ground and back along the way

  LeggedMarch(const Body& b, const LegTables& t, const Nodes& n, const Between& f, const Signals& s, const Laws& l,
              const Settings& set, Log& events, Notes& some, bool account, size_t driven)
      : Legged(b, t, n, f, s, l, set, events, driven), keeps_account(account), unit_body(b), notes(some) {
    moment.directions = body.directions;
    moment.legs.resize(body.directions * body.legs.size());
  }

  size_t mark_width() const { return size_t(3 + coordinates() + 2 * body.feet()); }
  size_t sample_width() const {
    const int sideways = directions() > DIRECTIONS ? 2 * legs() + body.feet() : 0;
    return 2 * coordinates() + 2 * DIRECTIONS * legs() + (body.lines.empty() ? 2 : 5) * body.feet() + sideways + ENERGIES + shares.size();
  }

  // Set everything to the start of a run. Its displacements and velocities: the body's, then of every leg the way along
  // before the height, then of every leg the place across.
  void begin(const RunData& run) {
    const double* initial = run.initial;
    const int nb = coordinates(), n = body.all_coordinates();
    settings = units.of(run, body.feet());
    laws.take(run.parameters);
    put_on_ground(run);
    clock = Clock();
    clock.mark = 0.0;
    player.restart(run.channels);
    for (int b = 0; b < nb; b++) {
      x[b] = initial[b];
      v[b] = initial[n + b];
    }
    channels.back() = Row(0.0);
    for (int i = 0; i < legs(); i++) {
      const int f = body.legs[i].foot;
      LeggedFoot& foot = feet[i];
      foot = LeggedFoot{};
      foot.film = f >= 0 && laws.has(f, HAS_MOMENTUM);
      foot.force = f >= 0 && laws.has(f, HAS_FORCE);
      foot.apex.integral = settings.track ? 0.0 : NOT_A_NUMBER;
      for (int d = 0; d < directions(); d++) {
        foot.u[d] = initial[body.coordinate(i, d)];
        foot.w[d] = initial[n + body.coordinate(i, d)];
      }
    }
    if (profile != nullptr) lay_ground(*this);
    for (int i : body.leg) {
      if (feet[i].film) base_at(i, gap_now(i));
    }
    energy = {};
    std::fill(shares.begin(), shares.end(), 0.0);
    length = 0.0;
    assemble_coupling(*this);
    lowest_body = INF;
    highest_body = -INF;
    step_class = int(settings.first_class);
    std::fill(std::begin(launch_class), std::end(launch_class), 0);
    launching = false;
    notes.sampled = 0;
  }

  // Rest gaps [m] of the feet, gravity [m/s^2], and the shape of the ground.
  void put_on_ground(const RunData& run) {
    gravity = run.sources + body.feet();
    if (!body.lines.empty()) body = unit_body;  // feet of the run before may have stood on slopes
    for (int f = 0; f < body.feet(); f++) body.legs[body.leg[f]].gap = run.sources[f];
    body.weigh(unit_body, gravity);
    if (body.lines.empty()) return;
    ground.clear();
    for (const Line& line : body.lines) ground.push_back({line, run.profile + line.first});
    profile = ground.data();
    if (body.patched) laws.patches.assign(body.feet(), {});
  }

  void enter() {}
  bool resolve_contacts() { return false; }

  // Note where the robot is at the end of a drive period, and how high feet and body went in it.
  void mark() {
    std::vector<double>& row = notes.marks;
    row.push_back(clock.time);
    row.insert(row.end(), x, x + coordinates());
    for (int i : body.leg) {
      double u[DIRECTIONS] = {feet[i].u[UP], feet[i].u[ALONG]};
      in_world(*this, i, u);
      row.push_back(u[ALONG]);
    }
    for (int i : body.leg) row.push_back(feet[i].slipped);
    row.push_back(std::min(lowest_body, x[1]));
    row.push_back(std::max(highest_body, x[1]));
    lowest_body = highest_body = x[1];
    for (int f = 0; f < body.feet(); f++) {
      LeggedFoot& foot = feet[body.leg[f]];
      if (foot.contact != AIR || clock.time <= 0.0) continue;
      log.add(clock.time, f, PERIOD_MARK, foot.apex);
      foot.apex.restart(clock.time);
    }
    if (clock.time >= clock.mark) clock.mark = ++clock.marks * settings.period;
  }

  // First step class in which the nodes see every free leg's own oscillation.
  int coarsest() const {
    int k = 0;
    for (int i = 0; i < legs(); i++) {
      in_directions<UP>(*this, [&](auto d) {
        if (!feet[i].held(d) || body.legs[i].turned) k = std::max(k, tables.longest[body.legs[i].kind[d]]);
      });
    }
    return k;
  }

  // Of the slip of a foot at the moment.
  double sense_at(int i, int d) {
    if (!any_way(i)) return feet[i].sense[d];
    const double size = std::hypot(moment.of(i, ALONG).w, moment.of(i, ACROSS).w);
    return size > 0.0 ? moment.of(i, d).w / size : feet[i].sense[d];
  }

  // A row of the sample times that lie in the step: body, legs, contacts and energies (those linear within
  // it).
  void sample(double h, double fraction, const Energies& before) {
    const double part = std::max(std::min((notes.times[notes.sampled] - clock.time) / h, fraction), 0.0);
    motion_at(*this, h, part, moment);
    put_sample(fraction > 0.0 ? part / fraction : 1.0, before);
  }
  // Note the moment, and energies at a share of the step.
  void put_sample(double share, const Energies& before) {
    double* to = notes.samples.data() + notes.sampled * sample_width();
    for (int b = 0; b < coordinates(); b++) *to++ = moment.x[b];
    for (int b = 0; b < coordinates(); b++) *to++ = moment.v[b];
    for (int i = 0; i < legs(); i++) {
      double u[DIRECTIONS], w[DIRECTIONS];
      for (int d = 0; d < DIRECTIONS; d++) {
        const Motion at = moment.of(i, d);
        const double share = film_share(i, d);
        const double film = share != 0.0 ? share * this->film(i, body.legs[i].clearance(moment.of(i, UP).u, moment.of(i, ALONG).u)) : 0.0;
        u[d] = at.u;
        w[d] = at.w + film / body.legs[i].mass;
      }
      in_world(*this, i, u);
      in_world(*this, i, w);
      for (int d = 0; d < DIRECTIONS; d++) {
        *to++ = u[d];
        *to++ = w[d];
      }
    }
    for (int i : body.leg) *to++ = feet[i].contact;
    for (int i : body.leg) *to++ = sense_at(i, ALONG);
    if (profile != nullptr) {
      for (int i : body.leg) *to++ = feet[i].contact == AIR ? body.legs[i].clearance(moment.of(i, UP).u, moment.of(i, ALONG).u) : 0.0;
      for (int i : body.leg) *to++ = feet[i].ground.cos;
      for (int i : body.leg) *to++ = feet[i].ground.sin;
    }
    if (directions() > DIRECTIONS) {
      for (int i = 0; i < legs(); i++) {
        *to++ = moment.of(i, ACROSS).u;
        *to++ = moment.of(i, ACROSS).w;
      }
      for (int i : body.leg) *to++ = sense_at(i, ACROSS);
    }
    const double* from = &before.work;
    const double* now = &energy.work;
    for (int e = 0; e < ENERGIES; e++) *to++ = from[e] + (now[e] - from[e]) * share;
    for (size_t e = 0; e < shares.size(); e++) *to++ = shares_before[e] + (shares[e] - shares_before[e]) * share;
    notes.sampled++;
  }

  // Lowest and highest place of the body. Nodes are less than NODE_SPACING of a step apart: between two of them the body rises
  // above both by less than half of that times its largest speed, and by twice as much where that, too, lies between nodes.
  static constexpr double NODE_SPACING = 0.22;
  void note_heights(double h, double fraction) {
    const double margin = NODE_SPACING * h * highest(magnitude(at.v[1]));
    if (lowest(at.x[1]) - margin < lowest_body) lowest_body = std::min(lowest_body, extreme(nodes, at.x[1], -1.0, fraction));
    if (highest(at.x[1]) + margin > highest_body) highest_body = std::max(highest_body, extreme(nodes, at.x[1], 1.0, fraction));
  }

  // Path [m] that a foot slides any way up to scaled time ``fraction`` of the step: the integral of its speed.
  double slide_any_way(int i, double h, double fraction) const {
    const LegRows& r = rows[i];
    const Row speed = any_way(i) ? slip_speed(r) : each(r.w[ALONG], r.w[ACROSS], [](double a, double b) { return std::hypot(a, b); });
    return integral_at(*this, speed, fraction) * h;
  }

  // Path [m] that a foot slides along the way up to scaled time ``fraction`` of the step, after which it is at ``end`` along the
  // ground. A foot without friction turns back without an event: where its speed changes sign between two nodes.
  double slide(int i, double h, double fraction, double end) {
    constexpr int d = ALONG;
    constexpr double EXACT = 1e-13;  // of the time between two nodes: what differences of runs see of the path is smooth to rounding then
    const LegRows& r = rows[i];
    const Row& speed = r.w[d];
    const bool by_nodes = smooth(*this, r, d, h);
    double path = 0.0, from = feet[i].u[d], sense = speed[0];
    for (int j = 1; j < N && nodes.tau[j - 1] < fraction; j++) {
      if (sense * speed[j] < 0.0) {
        const double up = sense < 0.0 ? 1.0 : -1.0;
        const Lowest turn = lowest_between(*this, j, [&](double at) {
          const Row here = lagrange(nodes, at);
          const Motion to = by_nodes ? Motion{total(r.u[d] * here), total(speed * here)} : leg_at(*this, i, d, h, at);
          return Motion{up * to.u, up * to.w};
        }, EXACT);
        if (turn.at >= fraction) break;
        path += std::fabs(up * turn.gap - from);
        from = up * turn.gap;
      }
      if (speed[j] != 0.0) sense = speed[j];
    }
    return path + std::fabs(end - from);
  }

  // Move the state on to scaled time ``fraction`` of the step. False where a number is not finite.
  bool accept(double h, double fraction, double reached) {
    const Energies before = energy;
    shares_before = shares;
    motion_at(*this, h, fraction, moment);
    if (keeps_account) add_energies(*this, h, fraction, moment);
    if (notes.sampled < notes.times.size() && notes.times[notes.sampled] <= reached) {
      while (notes.sampled < notes.times.size() && notes.times[notes.sampled] <= reached)
        sample(h, fraction, before);
      motion_at(*this, h, fraction, moment);
    }
    for (int i : body.leg) {
      LeggedFoot& foot = feet[i];
      if (foot.contact == AIR && settings.track) {
        raise_apex(nodes, foot.apex, reinterpret_cast<const double*>(&rows[i].gap), fraction, clock.time, h);
      } else if (foot.contact == SLIPPING) {
        foot.slipped += directions() > DIRECTIONS ? slide_any_way(i, h, fraction) : slide(i, h, fraction, moment.of(i, ALONG).u);
      }
    }
    note_heights(h, fraction);
    for (int i = 0; i < legs(); i++) {
      if (!any_way(i)) continue;
      double &along = moment.of(i, ALONG).w, &across = moment.of(i, ACROSS).w;
      const double part = speed_by_forces(*this, i, h, fraction, along, across);
      along *= part;
      across *= part;
    }
    double sum = 0.0;
    for (int b = 0; b < coordinates(); b++) {
      sum += (x[b] = moment.x[b]) + (v[b] = moment.v[b]);
    }
    for (int i = 0; i < legs(); i++) {
      feet[i].start = AS_IT_COMES;
      in_directions<UP>(*this, [&](auto d) {
        sum += (feet[i].u[d] = moment.of(i, d).u) + (feet[i].w[d] = moment.of(i, d).w);
      });
      if (!any_way(i)) continue;
      for (int d : {ALONG, ACROSS}) feet[i].sense[d] = sense_at(i, d);
    }
    clock.time = reached;
    origin = fraction;
    return std::isfinite(sum);
  }

  // The longest step that fits and whose nodes are exact enough: its class, or a code.
  struct Chosen {
    Code code;
    int k, wanted;
    Attempt made;
  };

  template <class Try>
  Chosen choose(double left, double reach, int coarsest, Try&& tried) {
    int k = std::max(step_class, coarsest);
    if (launching)
      k = std::max(k, launch_class[launched]);  // after an event of this kind: the step class that fitted after the last one
    Chosen out = {GOING_ON, k, k, {0.0, 0}};
    while (k + 1 < tables.classes() && tables.lengths[k + 1] >= left) k++;
    for (;;) {
      if (k >= tables.classes()) {
        out.code = out.made.error == UNDEFINED ? NOT_FINITE : STEP_TOO_SMALL;
        return out;
      }
      if (tables.lengths[k] > left && tables.lengths[k] > reach) {
        k++;
        continue;
      }
      out.k = k;
      out.made = tried(k);
      const double error = out.made.error;
      if (0.0 <= error && error <= 1.0) return out;
      clock.rejected++;
      k += classes_down(error);
      out.wanted = std::max(out.wanted, k);
    }
  }

  // The class to try next, longer where the error, or the one expected next, was far below the tolerance.
  void adapt(const Chosen& step, bool cut, int kind) {
    const double error = step.made.error;
    int wanted = step.wanted;
    const int longer = classes_up(error);
    if (launching) launch_class[launched] = step.k - longer;
    launching = cut;
    launched = kind;
    if (error > AIM || step.made.sweeps > MANY_SWEEPS) {
      wanted = std::max(wanted, step.k + 1);
    } else if (step.k <= wanted) {
      wanted = step.made.sweeps <= FEW_SWEEPS ? step.k - longer : step.k;
    }
    step_class = std::max(wanted, 0);
  }

  Code step() {
    const Player::Kink kink = player.next_kink(clock.time);
    const double goal = std::min(settings.end, clock.mark);
    const double left = std::min(kink.left, goal - clock.time);
    rebase();
    const Chosen chosen = choose(left, kink.reach, coarsest(), [this](int k) { return attempt(*this, k); });
    if (chosen.code != GOING_ON) return chosen.code;
    step_class = chosen.k;
    const double h = tables.lengths[chosen.k], limit = std::min(1.0, left / h);
    double first = 2.0;
    for (int f = 0; f < body.feet(); f++) {
      events[f] = first_of_foot(*this, body.leg[f], h, limit);
      first = std::min(first, events[f].low);
    }
    const double fraction = std::min(first, limit), reached = reached_at(h, first, limit, left, goal);
    if (fraction > 0.0 && !accept(h, fraction, reached)) return NOT_FINITE;
    int kind = 0;
    if (first <= limit) {
      kind = apply_events(first, h);
      assemble_coupling(*this);
    }
    adapt(chosen, fraction < 1.0 || first <= limit, kind);
    return GOING_ON;
  }

 private:
  std::vector<Bracket> events = std::vector<Bracket>(body.leg.size());  // the first one of every foot in the step

  // When a step of length h ends: at an event at scaled time ``first``, or after ``left`` at the goal or a kink.
  double reached_at(double h, double first, double limit, double left, double goal) const {
    if (first <= limit) return clock.time + first * h;
    return h <= left ? clock.time + h : left == goal - clock.time ? goal : clock.time + left;
  }
  // Whether the ground still presses a foot, by the forces of the moment, which a step of length h found to be pulled off: within the
  // tolerance of the step. From there the next step looks again, and is the more exact for it.
  bool still_pressed(int f, double first, double h) const {
    const int i = body.leg[f];
    if (events[f].kind != PULL_OFF || feet[i].wedged != 0 || first * h <= settings.least_progress) return false;
    return pull_on(*this, i) < strength_now(*this, i) - no_pull(*this, i);
  }
  // Apply the events of a step of length h, at scaled time ``first``. Returns the kind of the one after which steps are shortest.
  int apply_events(double first, double h) {
    const size_t before = log.events.size();
    int kind = 0;
    for (int f = 0; f < body.feet(); f++) {
      if (now(f, first) && !still_pressed(f, first, h)) apply_event(*this, body.leg[f], events[f].kind);
    }
    for (size_t e = before; e < log.events.size(); e++) {
      const int what = int(log.events[e].kind);
      if (kind == 0 || launch_class[what] > launch_class[kind]) kind = what;
    }
    return kind;
  }
  // Whether the event of a foot comes at scaled time ``first``, that of the first of all, to the rounding of both.
  static constexpr double SAME_EVENT = 1.0 + 1e-13;
  bool now(int f, double first) const { return events[f].kind != NOTHING && events[f].high <= first * SAME_EVENT; }
  std::vector<double> shares_before;
};

}  // namespace tarsus::legged

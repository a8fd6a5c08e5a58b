// Lanes beside a legged robot's run: where they begin, how steps and jumps move them on, and what is told of them.
#pragma once
#include "derive/legged_instant.hpp"
#include "derive/legged_power.hpp"
#include "derive/legged_tangent_step.hpp"
#include "legged/window.hpp"

namespace tarsus::legged {

// Derivatives: of event rows (events, EVENT_WIDTH), of marks as in Notes, of samples (times, displacements and velocities, then
// gaps, rates, resistive and smooth forces and pulls of the feet); of where contacts began (feet) and energies at the end.
struct LeggedSlopes {
  std::vector<Row> events, marks, samples, since, energies;
  std::vector<TangentFlag> flags;
};

class LeggedLanes : public LeggedMarch {
 public:
  LeggedSlopes slopes;

  // ``programs``: the laws by programs alone; lanes: how many of the eight have a number.
  LeggedLanes(const Body& b, const LegTables& t, const Nodes& n, const Between& f, const Signals& s, const Laws& l,
              const Laws& programs, const Settings& set, Log& events, Notes& some, bool account, size_t driven,
              const RunData& run, const DataTangents& data, int lanes,
              const std::vector<BesideBody>& beside)
      : LeggedMarch(b, t, n, f, s, l, set, events, some, account, driven), run_(run), data_(data), nothing_(data.nothing()),
        count_(lanes),
        laws_(programs, run.parameters, data.parameters), drives_(s, n, data, run, driven),
        still_laws_(programs, run.parameters, nothing_.parameters), still_drives_(s, n, nothing_, run, driven),
        acting_(*this, b, laws_, drives_, data_, drives_.player, &beside_),
        still_(*this, b, still_laws_, still_drives_, nothing_, drives_.player, nullptr) {
    for (const BesideBody& one : beside) beside_.emplace_back(one, *this, s, l, driven);
  }

  // Begin where the run has begun, which may be a window.
  void begin_lanes(bool window) {
    for (size_t c = 0; c < player.cursor.size(); c++) drives_.player.seek(int(c), clock.time);
    shared_at_ = begun_ = clock.time;
    for (BesideWalker& one : beside_) one.begin(*this, run_.parameters, gravity);
    bases_ = bases();
    linear_.feet.resize(legs());
    linear_.own.resize(size_t(legs()) * LANES);
    values_.resize(player.cursor.size() * N);
    slopes_.resize(player.cursor.size() * N);
    drives_.edges_at(clock.time, [&](int lane) { flag(EDGE_AT_START, lane); });
    for (int lane = 0; lane < count_; lane++) {
      lanes_.push_back(*this);
      begin_lane(lanes_.back(), lane, window);
    }
  }

  // At the end of the run.
  void finish() {
    for (int i : body.leg) slopes.since.push_back(lane_row([&](const Legged& t) { return t.feet[i].since; }));
    for (int e = 0; e < ENERGIES; e++) {
      slopes.energies.push_back(lane_row([&](const Legged& t) { return (&t.energy.work)[e]; }));
    }
  }

 protected:
  const RunData run_;
  const DataTangents& data_;
  DataTangents nothing_;
  const int count_;
  LawTangents laws_;
  DriveTangents drives_;
  LawTangents still_laws_;
  DriveTangents still_drives_;
  std::vector<BesideWalker> beside_;
  std::vector<double> bases_;  // of the films' momenta from which the lanes' rates count (legs) [N s]
  Acting acting_, still_;      // with the derivatives of laws and drives, and without
  std::vector<Legged> lanes_;
  LegTangents linear_;
  std::vector<double> values_;  // (channels, nodes)
  std::vector<Row> slopes_;
  std::vector<double> apexes_, ways_;  // highest gaps of the feet and places of the legs along the way, before the step
  Moment turning_;  // room for a lane's motion at one moment
  double h_ = 0.0, fraction_ = 0.0, begin_time_ = 0.0, begun_ = 0.0;
  JetPlace place_;
  Rates before_;
  Row shared_ = Row(0.0);  // derivative of the moment of the last event or moving kink, and that moment [s]
  double shared_at_ = -INF;

  std::vector<double> bases() const {
    std::vector<double> out;
    for (const LeggedFoot& foot : feet) out.push_back(foot.base);
    return out;
  }

  // A rate without the film's momentum counts that from its base: where this has moved, so has what a mass makes of it.
  void rebase_lanes() {
    for (const BesideWalker& one : beside_) {
      for (int i = 0; i < legs(); i++) {
        lanes_[one.lane].feet[i].w[UP] += (feet[i].base - bases_[i]) * one.weight / one.s.body.legs[i].mass;
      }
    }
    bases_ = bases();
  }

  // What the structures beside make of the run's step, for the lanes of their numbers.
  void follow_beside(int k, double h) {
    linear_.misfit.assign(beside_.empty() ? 0 : lanes_.size() * coordinates(), Row(0.0));
    for (BesideWalker& one : beside_) {
      one.follow(*this, k, h);
      for (int b = 0; b < coordinates(); b++) linear_.misfit[size_t(one.lane) * coordinates() + b] += one.misfit(b, h) * one.weight;
      for (int i = 0; i < legs(); i++) {
        const LinearFoot& f = linear_.feet[i];
        const LegRows& r = one.s.rows[i];
        OwnPart& own = linear_.own[size_t(i) * LANES + one.lane];
        if (feet[i].contact == AIR) {
          own.air[0] += f.by_gap[0] * r.u[UP] * one.weight;
          own.air[1] += (f.by_gap[1] * r.u[UP] + f.by_rate * r.rate) * one.weight;
        } else if (f.slides) {
          own.bound += f.by_margin * r.margin * one.weight;
        }
      }
      one.finish(h);
    }
  }

  // A lane's motion at scaled time s of the step.
  void lane_at(int lane, double h, double s, Moment& to) {
    motion_at(lanes_[lane], h, s, to);
    Moment own;
    own.legs.resize(DIRECTIONS * body.legs.size());
    for (const BesideWalker& one : beside_) {
      if (one.lane != lane) continue;
      motion_at(one.s, h, s, own);
      for (int b = 0; b < coordinates(); b++) {
        to.x[b] += one.weight * own.x[b];
        to.v[b] += one.weight * own.v[b];
      }
      for (size_t n = 0; n < to.legs.size(); n++) {
        to.legs[n].u += one.weight * own.legs[n].u;
        to.legs[n].w += one.weight * own.legs[n].w;
      }
    }
  }

  template <class F>
  Row lane_row(F&& value) const {
    Row out = Row(0.0);
    for (int lane = 0; lane < count_; lane++) out.set(lane, value(lanes_[lane]));
    return out;
  }
  // event: from which on there is no derivative; by default the next one.
  void flag(Doubtful reason, int lane, size_t event) { slopes.flags.push_back({double(event), double(reason), double(lane)}); }
  void flag(Doubtful reason, int lane) { flag(reason, lane, log.events.size()); }
  void lose() {
    flag(LOST, -1);
    for (Legged& t : lanes_) std::fill_n(t.v, coordinates(), NOT_A_NUMBER);
  }

  void begin_lane(Legged& t, int lane, bool window) {
    const int nb = coordinates(), n = nb + 2 * legs();
    const Row& gravity = data_.sources[body.feet()];
    t.settings.gap = t.settings.force_zero = 0.0;  // nothing is small enough to be left out
    t.lowest_body = t.highest_body = 0.0;
    t.energy = {};
    for (int b = 0; b < nb; b++) {
      t.x[b] = data_.initial[b][lane];
      t.v[b] = data_.initial[n + b][lane];
      t.body.weight[b] = gravity[lane] * unit_body.weight[b];
    }
    for (Row& one : t.channels) one = Row(0.0);
    for (int i = 0; i < legs(); i++) {
      const int f = body.legs[i].foot;
      LeggedFoot& foot = t.feet[i];
      t.body.legs[i].gap = f < 0 ? 0.0 : data_.sources[f][lane];
      t.body.legs[i].weight = gravity[lane] * unit_body.legs[i].weight;
      foot.apex = {};
      foot.slipped = 0.0;
      foot.since = f < 0 ? 0.0 : data_.since[f][lane];
      for (int d = 0; d < DIRECTIONS; d++) {
        foot.u[d] = data_.initial[nb + 2 * i + 1 - d][lane];
        foot.w[d] = data_.initial[n + nb + 2 * i + 1 - d][lane];
      }
      if (feet[i].film) {
        const Jet gap = jet(feet[i].u[UP] + body.legs[i].gap, Row(foot.u[UP] + t.body.legs[i].gap));
        foot.w[UP] -= laws_.momentum(f, gap).slope[lane] / body.legs[i].mass;
      }
      if (window && feet[i].contact != AIR) {
        foot.u[UP] = -t.body.legs[i].gap;
        foot.w[UP] = 0.0;
        if (feet[i].contact == STUCK) foot.w[ALONG] = 0.0;
      }
    }
    gather(t);
  }

  // The state of the run with the derivatives of the lanes.
  JetPlace place() const {
    JetPlace out;
    out.time = Jet(clock.time);
    for (int b = 0; b < coordinates(); b++) {
      out.x.push_back(jet(x[b], lane_row([&](const Legged& t) { return t.x[b]; })));
      out.v.push_back(jet(v[b], lane_row([&](const Legged& t) { return t.v[b]; })));
    }
    for (int i = 0; i < legs(); i++) {
      for (int d = 0; d < DIRECTIONS; d++) {
        out.u.push_back(jet(feet[i].u[d], lane_row([&](const Legged& t) { return t.feet[i].u[d]; })));
        out.w.push_back(jet(feet[i].w[d], lane_row([&](const Legged& t) { return t.feet[i].w[d]; })));
      }
      out.since.push_back(jet(feet[i].since, lane_row([&](const Legged& t) { return t.feet[i].since; })));
    }
    return out;
  }

  // Take a place along to a moment that moves.
  static void shift(JetPlace& at, const Rates& rate, const Row& by) {
    const auto move = [&](std::vector<Jet>& to, const std::vector<double>& rates) {
      for (size_t n = 0; n < to.size(); n++) to[n] = jet(to[n].value, slope_of(to[n]) + by * rates[n]);
    };
    move(at.x, rate.x);
    move(at.v, rate.v);
    move(at.u, rate.u);
    move(at.w, rate.w);
    at.time = jet(at.time.value, slope_of(at.time) + by);
  }

  // The lanes at fixed times after an event, from the place that moves with it.
  void settle() {
    for (int b = 0; b < coordinates(); b++) {
      place_.x[b].value = x[b];
      place_.v[b].value = v[b];
    }
    for (int i = 0; i < legs(); i++) {
      for (int d = 0; d < DIRECTIONS; d++) {
        place_.of(place_.u, i, d).value = feet[i].u[d];
        place_.of(place_.w, i, d).value = feet[i].w[d];
      }
    }
    const Rates after = still_.on(place_).rates();
    add_jump(before_, after, shared_);
    shift(place_, after, -shared_);
    for (int lane = 0; lane < count_; lane++) {
      Legged& t = lanes_[lane];
      for (int b = 0; b < coordinates(); b++) {
        t.x[b] = place_.x[b].slope[lane];
        t.v[b] = place_.v[b].slope[lane];
      }
      for (int i = 0; i < legs(); i++) {
        LeggedFoot& foot = t.feet[i];
        for (int d = 0; d < DIRECTIONS; d++) {
          foot.u[d] = place_.of(place_.u, i, d).slope[lane];
          foot.w[d] = place_.of(place_.w, i, d).slope[lane];
        }
        foot.since = place_.since[i].slope[lane];
        foot.contact = feet[i].contact;
        foot.sense = feet[i].sense;
      }
      gather(t);
    }
  }

  // What is summed up on the way changes by the difference of its rates where these jump.
  void add_jump(const Rates& before, const Rates& after, const Row& by) {
    for (int lane = 0; lane < count_; lane++) {
      for (int i = 0; i < legs(); i++) lanes_[lane].feet[i].slipped += (before.slipped[i] - after.slipped[i]) * by[lane];
      for (int e = 0; e < ENERGIES; e++) {
        (&lanes_[lane].energy.work)[e] += ((&before.power.work)[e] - (&after.power.work)[e]) * by[lane];
      }
    }
  }

  // ---- steps

  void linearise(double h) {
    const Row times = nodes.times() * h + clock.time;
    for (int lane = 0; lane < count_; lane++) {
      Legged& t = lanes_[lane];
      for (size_t c = 0; c < player.cursor.size(); c++) {
        for (int j = 0; j < N; j++) t.channels[c].set(j, slopes_[N * c + j][lane]);
      }
      load_feet(t);
    }
    for (int i = 0; i < legs(); i++) {
      LinearFoot& f = linear_.feet[i];
      const LeggedFoot& foot = feet[i];
      f.acts[0] = foot.contact == AIR && foot.film;
      f.acts[1] = foot.contact == AIR && foot.force;
      f.slides = foot.contact == SLIPPING && foot.sense != 0.0;
      f.by_gap[0] = f.by_gap[1] = f.by_rate = Row(0.0);
      if (foot.contact != AIR) linearise_held(i, times);
      if (!f.acts[0] && !f.acts[1]) continue;
      linearise_free(i, times);
      if (!invert_foot(tables.of(step_class, body.legs[i].kind[UP]), body.legs[i].mass, f)) lose();
    }
  }

  // Rows of a foot's own part in every lane, by the tangents of a function at the nodes.
  template <class F>
  void own_rows(int i, Row OwnPart::*part, F&& value) {
    for (int j = 0; j < N; j++) {
      const Row found = slope_of(value(j));
      for (int lane = 0; lane < count_; lane++) (linear_.own[size_t(i) * LANES + lane].*part).set(j, found[lane]);
    }
  }
  Jet volts_at(int f, int j) const {
    const int64_t c = laws.laws.volts[f];
    return c < 0 ? Jet(0.0) : jet(values_[N * c + j], slopes_[N * c + j]);
  }

  void linearise_free(int i, const Row& times) {
    LinearFoot& f = linear_.feet[i];
    const int foot = body.legs[i].foot;
    const LegRows& r = rows[i];
    Row none;
    Row arguments[4] = {r.gap, r.rate, volts(foot), times};
    if (f.acts[0]) laws_.slopes(MOMENTUM, foot, arguments, 1, f.by_gap[0], none);
    if (f.acts[1]) laws_.slopes(FORCE, foot, arguments, 4, f.by_gap[1], f.by_rate);
    for (int lane = 0; lane < count_; lane++) {
      OwnPart& own = linear_.own[size_t(i) * LANES + lane];
      for (int a = 0; a < 2; a++) own.air[a] = f.by_gap[a] * lanes_[lane].body.legs[i].gap;
    }
    const bool driven = f.acts[1] && laws.laws.volts[foot] >= 0;
    for (int j = 0; (laws_.varied[foot] || driven) && j < N; j++) {
      const Jet gap(r.gap[j]);
      const Row parts[2] = {
          f.acts[0] && laws_.varied[foot] ? slope_of(laws_.momentum(foot, gap)) : Row(0.0),
          f.acts[1] ? slope_of(laws_.force(foot, gap, Jet(r.rate[j]), volts_at(foot, j), Jet(times[j]))) : Row(0.0)};
      for (int lane = 0; lane < count_; lane++) {
        OwnPart& own = linear_.own[size_t(i) * LANES + lane];
        for (int a = 0; a < 2; a++) own.air[a].set(j, own.air[a][j] + parts[a][lane]);
      }
    }
  }

  void linearise_held(int i, const Row& times) {
    LinearFoot& f = linear_.feet[i];
    const int foot = body.legs[i].foot;
    const LegRows& r = rows[i];
    const Jet since = jet(feet[i].since, lane_row([&](const Legged& t) { return t.feet[i].since; }));
    own_rows(i, &OwnPart::strength, [&](int j) { return laws_.value(STRENGTH, foot, {Jet(times[j]) - since}); });
    own_rows(i, &OwnPart::smooth, [&](int j) {
      const Jet strength = laws_.value(STRENGTH, foot, {Jet(times[j]) - since});
      if (!feet[i].force) return strength;
      return strength - laws_.force(foot, Jet(0.0), Jet(0.0), volts_at(foot, j), Jet(times[j]));
    });
    if (!f.slides) return;
    const Row arguments[2] = {r.margin, r.strength};
    laws_.slopes(FRICTION, foot, arguments, 2, f.by_margin, f.by_strength);
    own_rows(i, &OwnPart::bound, [&](int j) { return laws_.value(FRICTION, foot, {Jet(r.margin[j]), Jet(r.strength[j])}); });
  }

  // Drives over the step; one that has jumped where its kink's time moves shifts the state by the difference of its rates.
  void pass_kinks(double h) {
    const std::vector<Cursor> left = drives_.player.cursor;
    for (size_t c = 0; c < left.size(); c++) {
      drives_.fill(int(c), clock.time, h, &values_[N * c], &slopes_[N * c]);
      const Cursor was = left[c], now = drives_.player.cursor[c];
      if (!drives_.passed(was, now, clock.time)) continue;
      const Row by = slope_of(drives_.beginning(int(c), now));
      for (int lane = 0; lane < count_ && shared_at_ == clock.time; lane++) {
        if (std::fabs(shared_[lane] - by[lane]) > 1e-9 * std::fabs(by[lane])) flag(APART, lane);
      }
      shared_ = by;
      shared_at_ = clock.time;
      if (!any_less(Row(0.0), magnitude(by))) continue;
      JetPlace here = place();
      const Rates after = still_.on(here).rates();
      drives_.player.cursor[c] = was;
      const Rates before = still_.rates();
      drives_.player.cursor[c] = now;
      place_ = here;
      before_ = before;
      shift(place_, before, by);
      settle();
    }
  }

  void move_lane_on(int lane, double h, double fraction) {
    Legged& t = lanes_[lane];
    moment.legs.resize(DIRECTIONS * body.legs.size());
    lane_at(lane, h, fraction, moment);
    for (int f = 0; f < body.feet(); f++) track(lane, f, h, fraction);
    if (lowest_at >= 0.0) t.lowest_body = height_at(lane, h, lowest_at);
    if (highest_at >= 0.0) t.highest_body = height_at(lane, h, highest_at);
    for (int i = 0; i < legs(); i++) {
      LeggedFoot& foot = t.feet[i];
      const double way = moment.of(i, ALONG).u - foot.u[ALONG];
      if (feet[i].contact == SLIPPING) foot.slipped += feet[i].u[ALONG] < ways_[i] ? -way : way;
      for (int d = 0; d < DIRECTIONS; d++) {
        foot.u[d] = moment.of(i, d).u;
        foot.w[d] = moment.of(i, d).w;
      }
    }
    std::copy_n(moment.x, coordinates(), t.x);
    std::copy_n(moment.v, coordinates(), t.v);
    t.clock.time = clock.time;
  }

  // Height of a lane's body within the step: it rings with the legs, and no polynomial through the nodes follows that.
  // At an event it turns at once, and that moment moves.
  double height_at(int lane, double h, double s) {
    const Legged& t = lanes_[lane];
    if (s <= 0.0) return t.x[1] + (shared_at_ == begin_time_ ? at.v[1][0] * shared_[lane] : 0.0);
    turning_.legs.resize(DIRECTIONS * body.legs.size());
    lane_at(lane, h, s, turning_);
    return turning_.x[1];
  }

  // The highest gap of a flight, and the integral of the gap.
  void track(int lane, int f, double h, double fraction) {
    const int i = body.leg[f];
    Legged& t = lanes_[lane];
    Apex& to = t.feet[i].apex;
    if (feet[i].contact != AIR || !settings.track) return;
    to.integral += integral_at(t, t.rows[i].gap, fraction) * h;
    for (const BesideWalker& one : beside_) {
      if (one.lane == lane) to.integral += one.weight * integral_at(one.s, one.s.rows[i].gap, fraction) * h;
    }
    if (feet[i].apex.gap == apexes_[f]) return;
    const double s = (feet[i].apex.time - begin_time_) / h;
    double line[N], bend = 0.0;
    store(line, powers(rows[i].gap));
    for (int c = N - 1; c > 1; c--) bend = bend * s + c * (c - 1) * line[c];
    Motion there = leg_at(t, i, UP, h, s);
    for (const BesideWalker& one : beside_) {
      if (one.lane != lane) continue;
      const Motion own = leg_at(one.s, i, UP, h, s);
      there = {there.u + one.weight * own.u, there.w + one.weight * own.w};
    }
    to.gap = there.u + t.body.legs[i].gap;
    if (s <= 0.0) {  // what is highest where it began moves with that
      to.gap += to.time * rows[i].rate[0];
      return;
    }
    to.time = s < fraction && bend < 0.0 ? -there.w * h * h / bend : 0.0;
  }
};

}  // namespace tarsus::legged

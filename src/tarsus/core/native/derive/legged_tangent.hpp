// Derivatives of a legged robot's run: lanes that follow it through its steps and events (see docs/gradients.md).
//
// How moments move, and what is reported, is in derive/shell.hpp. Feet act on each other only through the body, so that each
// event has a moment of its own.
#pragma once
#include "derive/legged_events.hpp"
#include "derive/legged_power.hpp"
#include "derive/legged_tangent_step.hpp"
#include "derive/shell.hpp"
#include "legged/window.hpp"

namespace tarsus::legged {

class LeggedTangent : public LeggedMarch, private Follower {
 public:
  LeggedSlopes slopes;
  EventShell reported;

  // ``programs``: the laws by programs alone; lanes: how many of the eight have a number.
  LeggedTangent(const Body& b, const LegTables& t, const Nodes& n, const Between& f, const Signals& s, const Laws& l,
              const Laws& programs, const Settings& set, Log& events, Notes& some, bool account, size_t driven,
              const RunData& run, const DataTangents& data, int lanes,
              const std::vector<PerturbedBody>& copies)
      : LeggedMarch(b, t, n, f, s, l, set, events, some, account, driven),
        reported(settings, b.feet(), run.scales[1], data.period), run_(run), data_(data), nothing_(data.nothing()),
        count_(lanes),
        laws_(programs, run.parameters, data.parameters), drives_(s, n, data, run, driven),
        still_laws_(programs, run.parameters, nothing_.parameters), still_drives_(s, n, nothing_, run, driven),
        acting_(*this, b, laws_, drives_, data_, drives_.player, &copies_),
        still_(*this, b, still_laws_, still_drives_, nothing_, drives_.player, nullptr), event_(*this, acting_, still_, reported) {
    for (const PerturbedBody& one : copies) copies_.emplace_back(one, *this, s, l, driven);
    follower = this;
  }

  // Begin where the run has begun, which may be a window.
  void begin_lanes(bool window) {
    for (size_t c = 0; c < player.cursor.size(); c++) drives_.player.seek(int(c), clock.time);
    reported.shared_at = begun_ = clock.time;
    for (PerturbedWalker& one : copies_) one.begin(*this, run_.parameters, gravity);
    bases_ = bases();
    if (profile != nullptr) deeds = &event_.deeds;
    stand_on_ground();
    linear_.feet.resize(legs());
    linear_.own.resize(size_t(legs()) * LANES);
    values_.resize(player.cursor.size() * N);
    slopes_.resize(player.cursor.size() * N);
    drives_.edges_at(clock.time, [&](int lane) { flag(EDGE_AT_START, lane); });
    for (int lane = 0; lane < count_; lane++) {
      lanes_.push_back(*this);
      lanes_.back().deeds = nullptr;
      begin_lane(lanes_.back(), lane, window);
    }
    if (window && any_less(Row(0.0), magnitude(data_.start))) begin_later();
  }

  // At the end of the run.
  void finish() {
    reported.events.resize(log.events.size() * EVENT_WIDTH, Row(0.0));
    for (int i : body.leg) slopes.since.push_back(lane_row([&](const Legged& t) { return t.feet[i].since; }));
    for (int e = 0; e < ENERGIES; e++) {
      slopes.energies.push_back(lane_row([&](const Legged& t) { return (&t.energy.work)[e]; }));
    }
  }

  // Every step, before the run's state moves on.
  void made(int k, double h, double fraction, double reached) override {
    pass_kinks(h);
    for (Legged& t : lanes_) t.step_class = k;
    h_ = h;
    fraction_ = fraction;
    open_ = false;
    begin_time_ = clock.time;
    rebase_lanes();
    linearise(h);
    for (int i : body.leg) {
      if (nearly_lands(i, h, fraction)) flag(NEAR_MISS);
      if (nearly_ends(i, h, fraction)) flag(AT_CORNER);
    }
    follow_copies(k, h);
    if (!solve_lanes(*this, lanes_, k, h, linear_)) lose();
    for (size_t n = notes.sampled; fraction > 0.0 && n < notes.times.size() && notes.times[n] <= reached; n++) {
      sample(h, std::max(std::min((notes.times[n] - clock.time) / h, fraction), 0.0), notes.times[n]);
    }
    apexes_.clear();
    for (int i : body.leg) apexes_.push_back(feet[i].apex.gap);
    started_ = feet;
    if (keeps_account && fraction > 0.0) add_power(*this, lanes_, copies_, data_, facets_, h, fraction);
  }

  // And after.
  void moved(double h, double fraction) override {
    if (fraction <= 0.0) return;
    for (int f = 0; f < body.feet(); f++) track(f, h, fraction);
    for (size_t lane = 0; lane < lanes_.size(); lane++) move_lane_on(int(lane), h, fraction);
  }

  // An event, before and after the run's state is changed by it.
  void before_event(int i, FootEvent kind) override {
    known_ = log.events.size();
    place_ = place();
    before_ = still_.on(place_).rates();
    const Jet value = acting_.on(place_).function(i, kind);
    const double rate = rate_of(i, kind);
    if (!open_) note_rates();
    at_once_ = fraction_ == 0.0 && reported.shared_at == clock.time && shares_moment(i, kind, value.value);
    if (!at_once_) {
      const bool ends = kind == HIGH_END || kind == LOW_END, near = grazes(i, kind, rate);
      const Margin found{slope_of(value), rate, near && !ends};
      if (near && ends) flag(AT_CORNER);
      if (open_) flag_order(-found.by / rate, rate, former_[body.legs[i].foot]);
      reported.take_moment(known_, found, clock.time);
    }
    open_ = true;
    reported.shared_at = clock.time;
    shift(place_, before_, reported.shared);
    event_.begin(place_, i, known_, at_once_);
  }

  void after_event(int i, FootEvent kind) override {
    event_.follow(i, kind);
    stand_on_ground();
    return_to_fixed_time();
  }

  void mark() override {
    const Row by = reported.mark_at(clock.time);
    const bool moves = any_less(Row(0.0), magnitude(by));
    JetPlace here = place();
    const Rates now = moves ? still_.on(here).rates() : Rates{};
    const size_t seen = log.events.size();
    const bool low = x[1] <= lowest_body, high = x[1] >= highest_body;
    std::vector<Apex> apexes;
    for (int i : body.leg) apexes.push_back(feet[i].apex);
    note_mark();
    mark_lanes(by, moves ? &now : nullptr, low, high);
    for (size_t e = seen; e < log.events.size(); e++) {
      const int f = int(log.events[e].foot);
      const bool rising = apexes[f].time == clock.time && apexes[f].gap > 0.0;
      const int i = body.leg[f];
      reported.put_mark(e, f, by, gap_now(i), moves ? approach(i, now.u) : 0.0, rising);
    }
  }

 private:
  const RunData run_;
  const DataTangents& data_;
  DataTangents nothing_;
  const int count_;
  LawTangents laws_;
  DriveTangents drives_;
  LawTangents still_laws_;
  DriveTangents still_drives_;
  std::vector<PerturbedWalker> copies_;
  std::vector<double> bases_;  // of the films' momenta from which the lanes' rates count (legs) [N s]
  Acting acting_, still_;      // with the derivatives of laws and drives, and without
  FootEvents event_;
  std::vector<Legged> lanes_;
  LegTangents linear_;
  std::vector<double> values_;  // (channels, nodes)
  std::vector<Row> slopes_;
  std::vector<double> apexes_;       // highest gaps of the feet before the step
  std::vector<LeggedFoot> started_;  // of every leg, where the step starts
  Moment turning_;  // room for a lane's motion at one moment
  double h_ = 0.0, fraction_ = 0.0, begin_time_ = 0.0, begun_ = 0.0;
  JetPlace place_;
  Rates before_;
  size_t known_ = 0;                     // events when the present one began
  bool open_ = false, at_once_ = false;  // an event has been applied in this step; the present one shares its moment
  std::vector<FacetOf<Jet>> facets_;     // of every leg on uneven ground
  std::vector<Row> leans_, gaps_;        // by what these turn, and derivatives of the gaps above them of feet at rest
  std::vector<double> former_;           // rates of the functions of its events before the first of them, by foot

  std::vector<double> bases() const {
    std::vector<double> out;
    for (const LeggedFoot& foot : feet) out.push_back(foot.base);
    return out;
  }

  // A rate without the film's momentum counts that from its base: where this has moved, so has what a mass makes of it.
  void rebase_lanes() {
    for (int i : body.leg) {
      const double gained = feet[i].base - bases_[i];
      for (int d = 0; d < DIRECTIONS && gained != 0.0; d++) {
        const double share = film_share(i, d);
        for (const PerturbedWalker& one : copies_) lanes_[one.lane].feet[i].w[d] += share * gained * one.weight / one.s.body.legs[i].mass;
        if (profile == nullptr) continue;
        const Row turned = turning(i, d) * (gained / body.legs[i].mass);
        for (int lane = 0; lane < count_; lane++) lanes_[lane].feet[i].w[d] += turned[lane];
      }
    }
    bases_ = bases();
  }

  // ---- uneven ground. A lane of a foot on a facet lives in the directions of the run's facet, a place in those of the facet as it turns.

  // Facets below the feet, and their factors of the laws.
  void stand_on_ground() {
    if (profile == nullptr) return;
    facets_.resize(legs());
    leans_.assign(legs(), Row(0.0));
    gaps_.assign(legs(), Row(0.0));
    JetPlace here;
    for (int i : body.leg) {
      facets_[i] = acting_.facet(i, feet[i].ground.number);
      leans_[i] = leaning(facets_[i]);
      event_.take_patch(i, feet[i].ground.number);
      bases_[i] = feet[i].base;
    }
    here.ground = facets_;
    acting_.on(here);
    for (int i : body.leg) gaps_[i] = slope_of(acting_.gap(i));
  }
  // How the normal of the facet below a foot turns.
  Row turning(int i, int d) const { return leans_[i] * (d == UP ? -feet[i].ground.sin : -feet[i].ground.cos); }
  // The feet on facets from the directions of the run's (by = 1) into those of theirs, or back.
  void turn_places(JetPlace& at, double by) const {
    for (int i : body.leg) {
      if (profile == nullptr || !at.on[i]) continue;
      rotate(&at.of(at.u, i, UP), Jet(1.0), jet(0.0, leans_[i] * by));
      rotate(&at.of(at.w, i, UP), Jet(1.0), jet(0.0, leans_[i] * by));
    }
  }
  // Rate at which a foot in the air departs from its facet, of rates in the directions that it lives in.
  double approach(int i, const std::vector<double>& rates) const {
    return normal_share(i, UP) * rates[DIRECTIONS * size_t(i) + UP] + normal_share(i, ALONG) * rates[DIRECTIONS * size_t(i) + ALONG];
  }
  // The run's step with each perturbed structure, for the lanes of their numbers.
  void follow_copies(int k, double h) {
    linear_.misfit.assign(copies_.empty() ? 0 : lanes_.size() * coordinates(), Row(0.0));
    for (PerturbedWalker& one : copies_) {
      one.follow(*this, k, h);
      for (int b = 0; b < coordinates(); b++) linear_.misfit[size_t(one.lane) * coordinates() + b] += one.misfit(b, h) * one.weight;
      for (int i = 0; i < legs(); i++) {
        const LinearFoot& f = linear_.feet[i];
        const LegRows& r = one.s.rows[i];
        OwnPart& own = linear_.own[size_t(i) * LANES + one.lane];
        if (feet[i].contact == AIR) {
          const Row gap = r.u[UP] * normal_share(i, UP) + r.u[ALONG] * normal_share(i, ALONG);
          own.air[0] += f.by_gap[0] * gap * one.weight;
          own.air[1] += (f.by_gap[1] * gap + f.by_rate * r.rate) * one.weight;
        } else if (f.slides) {
          own.bound += (f.by[MARGIN] * r.margin + f.by[SLIP_SPEED] * r.w[ALONG] * feet[i].sense[ALONG]) * one.weight;
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
    for (const PerturbedWalker& one : copies_) {
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
  // The value of a lane with those of its perturbed copies.
  template <class F>
  Row moved_row(F&& value) const {
    Row out = lane_row(value);
    for (const PerturbedWalker& one : copies_) out.set(one.lane, out[one.lane] + one.weight * value(one.s));
    return out;
  }
  void flag(Doubtful reason, int lane = -1) { reported.flag(log.events.size(), reason, lane); }
  void lose() {
    flag(LOST);
    for (Legged& t : lanes_) std::fill_n(t.v, coordinates(), NOT_A_NUMBER);
  }

  void begin_lane(Legged& t, int lane, bool window) {
    const int nb = coordinates(), n = nb + 2 * legs();
    const Row* gravity = data_.sources.data() + body.feet();
    const double of_lane[DIRECTIONS] = {gravity[UP][lane], gravity[ALONG][lane]};
    t.body.weigh(unit_body, of_lane);
    t.settings.gap = t.settings.force_zero = 0.0;  // no change is small enough to be excluded
    t.lowest_body = t.highest_body = 0.0;
    t.energy = {};
    for (int b = 0; b < nb; b++) {
      t.x[b] = data_.initial[b][lane];
      t.v[b] = data_.initial[n + b][lane];
    }
    for (Row& one : t.channels) one = Row(0.0);
    for (int i = 0; i < legs(); i++) {
      const int f = body.legs[i].foot;
      LeggedFoot& foot = t.feet[i];
      t.body.legs[i].gap = f < 0 ? 0.0 : data_.sources[f][lane];
      foot.slipped = 0.0;
      const bool begins = window && feet[i].since == clock.time;
      foot.since = f < 0 ? 0.0 : data_.since[f][lane] + (begins ? data_.start[lane] : 0.0);
      foot.aged = 0.0;
      foot.parted = window && feet[i].parted == clock.time ? data_.start[lane] : 0.0;
      for (int d = 0; d < DIRECTIONS; d++) {
        foot.u[d] = data_.initial[nb + 2 * i + 1 - d][lane];
        foot.w[d] = data_.initial[n + nb + 2 * i + 1 - d][lane];
      }
      if (profile != nullptr && f >= 0) {
        begin_above(t, i, lane);
        continue;
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
    follow_legs(t, lane);
    assemble_coupling(t);
  }

  // A foot that begins above or on a facet.
  void begin_above(Legged& t, int i, int lane) {
    LeggedFoot& foot = t.feet[i];
    const LeggedFoot& run = feet[i];
    t.level[i].gap = t.body.legs[i].gap;
    std::copy_n(t.body.legs[i].weight, DIRECTIONS, t.level[i].weight);
    if (run.contact == AIR) {
      if (!run.film) return;
      double gap = gaps_[i][lane];
      for (int d = 0; d < DIRECTIONS; d++) gap += turning(i, d)[lane] * run.u[d] + normal_share(i, d) * foot.u[d];
      Row by = Row(0.0);
      by.set(lane, gap);
      const double momentum = laws_.momentum(body.legs[i].foot, jet(gap_now(i), by)).slope[lane] / body.legs[i].mass;
      for (int d = 0; d < DIRECTIONS; d++) foot.w[d] -= normal_share(i, d) * momentum;
      return;
    }
    in_facet(i, foot.u);
    in_facet(i, foot.w);
    foot.u[UP] = leans_[i][lane] * run.u[ALONG] - gaps_[i][lane];
    foot.w[UP] = leans_[i][lane] * run.w[ALONG];
    if (run.contact == STUCK) foot.w[ALONG] = 0.0;
  }
  void in_facet(int i, double* vector) const {
    if (body.legs[i].turned) rotate(vector, feet[i].ground.cos, feet[i].ground.sin);
  }

  // The legs of a lane are those of the run; its own are gaps and weights.
  void follow_legs(Legged& t, int lane) const {
    if (profile == nullptr) return;
    for (int i : body.leg) {
      Leg& leg = t.body.legs[i];
      leg = body.legs[i];
      std::copy_n(t.level[i].weight, DIRECTIONS, leg.weight);
      in_facet(i, leg.weight);
      leg.gap = gaps_[i][lane];
      t.feet[i].ground = feet[i].ground;
    }
    t.body.gain = body.gain;
  }

  // The state of the run with the derivatives of the lanes.
  JetPlace place() const {
    JetPlace out;
    out.ground = facets_;
    for (const LeggedFoot& foot : feet) out.on.push_back(foot.contact != AIR);
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
      const auto moved = [&](double Grip<double>::*part) {
        return jet(feet[i].*part, lane_row([&](const Legged& t) { return t.feet[i].*part; }));
      };
      out.grip.push_back({moved(&Grip<double>::since), moved(&Grip<double>::aged), moved(&Grip<double>::parted)});
    }
    turn_places(out, 1.0);
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
  void return_to_fixed_time() {
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
    add_jump(before_, after, reported.shared);
    shift(place_, after, -reported.shared);
    take_lanes();
  }

  // The state is that of the start, whose moment moves: back to the fixed one.
  void begin_later() {
    place_ = place();
    shift(place_, still_.on(place_).rates(), -data_.start);
    take_lanes();
  }

  // The derivatives of the place, as those of the lanes.
  void take_lanes() {
    turn_places(place_, -1.0);
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
        foot.since = place_.grip[i].since.slope[lane];
        foot.aged = place_.grip[i].aged.slope[lane];
        foot.parted = place_.grip[i].parted.slope[lane];
        foot.contact = feet[i].contact;
        std::copy_n(feet[i].sense, MOST_DIRECTIONS, foot.sense);
      }
      follow_legs(t, lane);
      assemble_coupling(t);
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
      f.slides = foot.contact == SLIPPING && foot.sense[ALONG] != 0.0;
      f.bends = foot.contact == SLIPPING && (body.legs[i].turned || slips_by_speed(*this, i));
      f.by_gap[0] = f.by_gap[1] = f.by_rate = f.by[MARGIN] = f.by[HELD_STRENGTH] = f.by[SLIP_SPEED] = Row(0.0);
      lean_lanes(i);
      if (foot.contact != AIR) linearise_held(i, times);
      if (!f.acts[0] && !f.acts[1]) continue;
      linearise_free(i, times);
      const LegStep* const own[] = {&tables.of(step_class, body.legs[i].kind[UP]), &tables.of(step_class, body.legs[i].kind[ALONG])};
      if (!invert_foot(own, body.legs[i], f)) lose();
    }
  }

  // What moves the facet below a foot adds to the rows of the lanes.
  void lean_lanes(int i) {
    const bool flies = feet[i].contact == AIR, uneven = profile != nullptr && body.legs[i].foot >= 0;
    const Leg& leg = body.legs[i];
    const LegRows& r = rows[i];
    Row along = Row(0.0);  // the structure's force on a foot that slides
    if (uneven && feet[i].contact == SLIPPING) {
      along = r.load[ALONG] + spring(*this, leg, ALONG) - r.u[ALONG] * leg.stiffness[ALONG] - r.w[ALONG] * leg.damping[ALONG] -
              feet[i].u[UP] * leg.cross_stiffness;
    }
    for (int lane = 0; lane < count_; lane++) {
      OwnPart& own = linear_.own[size_t(i) * LANES + lane];
      own.lift[0] = Row(flies ? lanes_[lane].body.legs[i].gap : 0.0);
      own.lift[1] = own.push[UP] = own.push[ALONG] = own.film[UP] = own.film[ALONG] = own.turned = Row(0.0);
      const double lean = uneven ? leans_[i][lane] : 0.0;
      lanes_[lane].rows[i].leans = flies && lean != 0.0 && feet[i].film;
      if (lean == 0.0 || feet[i].contact == STUCK) continue;
      for (int d = 0; flies && d < DIRECTIONS; d++) {
        const double turned = turning(i, d)[lane];
        own.lift[0] += r.u[d] * turned;
        own.lift[1] += r.w[d] * turned;
        if (feet[i].film) own.film[d] = r.film * turned;
        if (feet[i].force) own.push[d] = r.smooth * turned;
      }
      if (flies) continue;
      own.lift[0] = (r.u[ALONG] - feet[i].u[ALONG]) * lean;
      own.lift[1] = r.w[ALONG] * lean;
      own.push[ALONG] = (r.smooth - r.margin) * lean;
      own.turned = along * lean;
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
      for (int a = 0; a < 2; a++) own.air[a] = f.by_gap[a] * own.lift[0];
      own.air[1] += f.by_rate * own.lift[1];
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
    own_rows(i, &OwnPart::strength, [&](int j) { return laws_.strength(foot, Jet(times[j]) - since, volts_at(foot, j)); });
    own_rows(i, &OwnPart::smooth, [&](int j) {
      const Jet strength = laws_.strength(foot, Jet(times[j]) - since, volts_at(foot, j));
      if (!feet[i].force) return strength;
      return strength - laws_.force(foot, Jet(0.0), Jet(0.0), volts_at(foot, j), Jet(times[j]));
    });
    for (int lane = 0; lane < count_; lane++) linear_.own[size_t(i) * LANES + lane].smooth += linear_.own[size_t(i) * LANES + lane].turned;
    if (!f.slides) return bend(i);
    const SlidingTangent found = sliding_tangent(laws_, foot, r.margin, r.strength, r.w[ALONG] * feet[i].sense[ALONG], feet[i].just_slides());
    std::copy_n(found.by, FRICTION_ARGUMENTS, f.by);
    for (int lane = 0; lane < LANES; lane++) linear_.own[size_t(i) * LANES + lane].bound = found.own[lane];
    bend(i);
  }

  // How the force along the ground on a foot that slides depends on its own motion there, beyond its tables.
  void bend(int i) {
    LinearFoot& f = linear_.feet[i];
    if (!f.bends) return;
    const Leg& leg = body.legs[i];
    const double sense = feet[i].sense[ALONG];
    f.rub[0] = f.by[MARGIN] * leg.cross_stiffness;
    f.rub[1] = f.by[MARGIN] * leg.cross_damping + f.by[SLIP_SPEED] * sense;
    f.bend[0] = f.rub[0] * sense + leg.more_stiffness;
    f.bend[1] = f.rub[1] * sense + leg.more_damping;
    if (!invert_bend(tables.of(step_class, leg.kind[ALONG]), f)) lose();
  }

  // Drives over the step; one that has jumped where its kink's time moves shifts the state by the difference of its rates.
  void pass_kinks(double h) {
    const std::vector<Cursor> left = drives_.player.cursor;
    for (size_t c = 0; c < left.size(); c++) {
      drives_.fill(int(c), clock.time, h, &values_[N * c], &slopes_[N * c]);
      const Cursor was = left[c], now = drives_.player.cursor[c];
      if (!drives_.passed(was, now, clock.time)) continue;
      const Row by = slope_of(drives_.beginning(int(c), now));
      if (!reported.take_kink(log.events.size(), by, clock.time)) continue;
      JetPlace here = place();
      const Rates after = still_.on(here).rates();
      drives_.player.cursor[c] = was;
      const Rates before = still_.rates();
      drives_.player.cursor[c] = now;
      place_ = here;
      before_ = before;
      shift(place_, before, by);
      return_to_fixed_time();
    }
  }

  void move_lane_on(int lane, double h, double fraction) {
    Legged& t = lanes_[lane];
    moment.legs.resize(DIRECTIONS * body.legs.size());
    lane_at(lane, h, fraction, moment);
    if (lowest_at >= 0.0) t.lowest_body = height_at(lane, h, lowest_at);
    if (highest_at >= 0.0) t.highest_body = height_at(lane, h, highest_at);
    for (int i = 0; i < legs(); i++) {
      LeggedFoot& foot = t.feet[i];
      if (feet[i].contact == SLIPPING) foot.slipped += path_of_lane(lane, i, h);
      for (int d = 0; d < DIRECTIONS; d++) {
        foot.u[d] = moment.of(i, d).u;
        foot.w[d] = moment.of(i, d).w;
      }
      if (profile == nullptr || feet[i].contact != SLIPPING) continue;
      const double lifted = leans_[i][lane] * (feet[i].u[ALONG] - started_[i].u[ALONG]);
      foot.u[UP] += lifted;
      body.legs[i].hip[UP].carry(body.legs[i].stiffness[UP] * lifted, t.coupling.offset);
      foot.w[UP] = leans_[i][lane] * feet[i].w[ALONG];
    }
    std::copy_n(moment.x, coordinates(), t.x);
    std::copy_n(moment.v, coordinates(), t.v);
    t.clock.time = clock.time;
  }

  // How the path moves that a foot slides in the step: with its ends and with the places where it turns back, the moments of which
  // count for nothing, for it stands still there. The lane's motion at the end of the step is in ``moment``.
  double path_of_lane(int lane, int i, double h) {
    double path = 0.0, place = started_[i].u[ALONG], from = lanes_[lane].feet[i].u[ALONG];
    const auto reach = [&](double next, double to) {
      path += next < place ? from - to : to - from;
      place = next;
      from = to;
    };
    for (const Turn& turn : turns[i]) {
      turning_.legs.resize(DIRECTIONS * body.legs.size());
      lane_at(lane, h, turn.at, turning_);
      reach(turn.place, turning_.of(i, ALONG).u);
    }
    reach(feet[i].u[ALONG], moment.of(i, ALONG).u);
    return path;
  }

  // Height of a lane's body within the step: it rings with the legs, and no polynomial through the nodes follows that.
  // At an event it turns at once, and that moment moves.
  double height_at(int lane, double h, double s) {
    const Legged& t = lanes_[lane];
    if (s <= 0.0) return t.x[1] + (reported.shared_at == begin_time_ ? at.v[1][0] * reported.shared[lane] : 0.0);
    turning_.legs.resize(DIRECTIONS * body.legs.size());
    lane_at(lane, h, s, turning_);
    return turning_.x[1];
  }

  // The highest gap of a flight, and the integral of the gap.
  void track(int f, double h, double fraction) {
    const int i = body.leg[f];
    FootTangent& to = reported.feet[f];
    if (feet[i].contact != AIR || !settings.track) return;
    to.integral += moved_row([&](const Legged& t) { return integral_at(t, t.rows[i].gap, fraction) * h; });
    if (feet[i].apex.gap == apexes_[f]) return;
    const double s = (feet[i].apex.time - begin_time_) / h;
    double line[N], bend = 0.0;
    store(line, powers(rows[i].gap));
    for (int c = N - 1; c > 1; c--) bend = bend * s + c * (c - 1) * line[c];
    const auto normal = [&](double (*part)(const Motion&)) {
      return moved_row([&](const Legged& t) {
        double out = 0.0;
        for (int d = 0; d < DIRECTIONS; d++) {
          if (normal_share(i, d) != 0.0) out += normal_share(i, d) * part(leg_at(t, i, d, h, s));
        }
        return out;
      }) + turned_row(i, part, h, s);
    };
    to.apex = normal([](const Motion& at) { return at.u; }) + (profile != nullptr ? gaps_[i] : data_.sources[f]);
    if (s <= 0.0) {  // what is highest where it began moves with that
      to.apex += to.apex_time * rows[i].rate[0];
      return;
    }
    const bool inside = s < fraction && bend < 0.0;
    to.apex_time = inside ? normal([](const Motion& at) { return at.w; }) * (-h * h / bend) : Row(0.0);
  }
  // What a facet's turning makes of the run's motion above it, in the step from which the state has moved on.
  Row turned_row(int i, double (*part)(const Motion&), double h, double s) {
    Row out = Row(0.0);
    std::swap(feet, started_);
    for (int d = 0; profile != nullptr && d < DIRECTIONS; d++) out += turning(i, d) * part(leg_at(*this, i, d, h, s));
    std::swap(feet, started_);
    return out;
  }

  // ---- events

  // First step class in which the nodes resolve how the body moves on its held legs: a run that is at rest needs no such
  // steps, its derivatives do.
  int resolving() const override {
    double rate = 0.0;
    for (int b = 0; b < coordinates(); b++) {
      rate = std::max({rate, std::sqrt(coupling.stiffness[b][b] / body.mass[b]), coupling.damping[b][b] / body.mass[b]});
    }
    int k = 0;
    while (k + 1 < tables.classes() && tables.lengths[k] * rate > RESOLVED_TURN) k++;
    return k;
  }
  static constexpr double RESOLVED_TURN = 0.75;  // radians in a step: polynomials of degree 7 leave 1e-10 of a sine

  // Rate [1/s] of an event's function as the state moves on.
  double rate_of(int i, FootEvent kind) {
    JetPlace on = place_;
    const auto still = [](std::vector<Jet>& values) {
      for (Jet& one : values) one = Jet(one.value);
    };
    for (auto* part : {&on.x, &on.v, &on.u, &on.w}) still(*part);
    for (Grip<Jet>& one : on.grip) one.since = Jet(one.since.value);
    for (FacetOf<Jet>& one : on.ground) {
      for (Jet* part : {&one.x, &one.z, &one.cos, &one.sin, &one.low, &one.high}) *part = Jet(part->value);
    }
    shift(on, before_, Row(1.0));
    return still_.on(on).function(i, kind).slope[0];
  }

  // Whether an event at the start of a step has the moment of the one just before it: a jump beyond rounding, or a foot that
  // lies there from the start.
  bool shares_moment(int i, FootEvent kind, double value) const {
    if (kind == TOUCH) return clock.time == begun_ || -(normal_share(i, UP) * place_.of(place_.w, i, UP).value + normal_share(i, ALONG) * place_.of(place_.w, i, ALONG).value) <= no_rate(*this, i, 0.0);
    if (kind == STOP || kind == HIGH_END || kind == LOW_END) return clock.time == begun_;
    return clock.time == begun_ || value < -JUMP * run_.scales[1];
  }
  static constexpr double JUMP = 1e-9;  // part of the scale of forces; functions that pass zero overshoot it by less

  bool nearly_lands(int i, double h, double fraction) const {
    return feet[i].contact == AIR && turns_near(rows[i].gap, h, fraction, [&](double s) { return gap_at(*this, i, h, s); });
  }
  // Whether a foot turns so close before an end of its facet.
  bool nearly_ends(int i, double h, double fraction) const {
    if (profile == nullptr || feet[i].contact == STUCK) return false;
    for (int way : {1, -1}) {
      const Row left = (end_of(*this, i, way) - body.legs[i].place - rows[i].u[ALONG]) * double(way);
      if (std::isfinite(left[0]) && turns_near(left, h, fraction, [&](double s) { return left_at(*this, i, way, h, s); })) return true;
    }
    return false;
  }
  template <class At>
  bool turns_near(const Row& left, double h, double fraction, At&& motion) const {
    return reported.nearly_lands(nodes, left, fraction, [&](double s) {
      const Motion at = motion(s);
      return std::pair<double, double>(at.u, at.w * h);
    });
  }

  // A touchdown that would dip below the ground by less than GRAZE errors of a gap; a force or speed that hardly passes zero.
  bool grazes(int i, FootEvent kind, double rate) const {
    if (kind == TOUCH) return reported.gap_grazes(rate, approach(i, before_.w));
    if (kind == HIGH_END || kind == LOW_END) return !(std::fabs(rate) > settings.gap / settings.end);
    return kind == STOP ? !(std::fabs(rate) > settings.gap / (settings.end * settings.end)) : reported.force_grazes(rate);
  }

  // A force that releases a foot at the moment of another foot's event, by which its rate jumps, has no moment of its own where they
  // part: which comes first decides.
  void flag_order(const Row& own, double rate, double former) {
    if (std::fabs(rate - former) <= 1e-9 * std::fabs(rate)) return;
    for (int lane = 0; lane < count_; lane++) {
      if (std::fabs(own[lane] - reported.shared[lane]) > 1e-6 * std::fabs(own[lane])) flag(SIMULTANEOUS, lane);
    }
  }
  void note_rates() {
    former_.assign(body.feet(), 0.0);
    for (int f = 0; f < body.feet(); f++) {
      if (now(f, fraction_)) former_[f] = rate_of(body.leg[f], events[f].kind);
    }
  }

  // ---- what is reported

  void mark_lanes(const Row& by, const Rates* rate, bool low, bool high) {
    std::vector<Row>& to = slopes.marks;
    const auto moving = [&](const Row& found, double speed) { return rate != nullptr ? found + by * speed : found; };
    to.push_back(by);
    std::vector<Row> place;
    for (int b = 0; b < coordinates(); b++) {
      place.push_back(moving(lane_row([&](const Legged& t) { return t.x[b]; }), rate != nullptr ? rate->x[b] : 0.0));
    }
    to.insert(to.end(), place.begin(), place.end());
    for (int i : body.leg) {
      const auto world = [&](const double* of) {
        double own[DIRECTIONS] = {of[UP], of[ALONG]};
        in_world(*this, i, own);
        return own[ALONG];
      };
      to.push_back(moving(lane_row([&](const Legged& t) { return world(t.feet[i].u); }),
                          rate != nullptr ? world(&rate->u[DIRECTIONS * size_t(i)]) : 0.0));
    }
    for (int i : body.leg) {
      to.push_back(moving(lane_row([&](const Legged& t) { return t.feet[i].slipped; }), rate != nullptr ? rate->slipped[i] : 0.0));
    }
    to.push_back(low ? place[1] : lane_row([](const Legged& t) { return t.lowest_body; }));
    to.push_back(high ? place[1] : lane_row([](const Legged& t) { return t.highest_body; }));
    for (int lane = 0; lane < count_; lane++) lanes_[lane].lowest_body = lanes_[lane].highest_body = place[1][lane];
  }

  // At scaled time s of the step.
  void sample(double h, double s, double time) {
    Moment here;
    here.legs.resize(DIRECTIONS * body.legs.size());
    motion_at(*this, h, s, here);
    JetPlace to = place();
    to.time = Jet(time);
    const auto fill = [&](auto&& value) {
      for (int b = 0; b < coordinates(); b++) {
        value(to.x[b], here.x[b]);
        value(to.v[b], here.v[b]);
      }
      for (int i = 0; i < legs(); i++) {
        for (int d = 0; d < DIRECTIONS; d++) {
          value(to.of(to.u, i, d), here.of(i, d).u);
          value(to.of(to.w, i, d), here.of(i, d).w);
        }
      }
    };
    fill([](Jet& one, double value) { one = Jet(value); });
    for (int lane = 0; lane < count_; lane++) {
      lane_at(lane, h, s, here);
      fill([&](Jet& one, double value) { one.slope[lane] = value; });
    }
    for (int i : body.leg) {  // in the directions of the facet as it turns it moves along that alone
      if (profile == nullptr || feet[i].contact == AIR) continue;
      to.of(to.u, i, UP) = jet(to.of(to.u, i, UP).value, slope_of(to.of(to.u, i, UP)) + leans_[i] * (to.of(to.u, i, ALONG).value - feet[i].u[ALONG]));
      to.of(to.w, i, UP) = jet(0.0, leans_[i] * to.of(to.w, i, ALONG).value);
    }
    turn_places(to, 1.0);
    note_sample(to);
  }

  void note_sample(JetPlace& to) {
    acting_.on(to);
    std::vector<Row>& out = slopes.samples;
    std::vector<Row> resistive, smooth, pull, gaps, rates;
    for (int i : body.leg) {
      const bool free = feet[i].contact == AIR;
      const Jet gap = acting_.clearance(i), rate = acting_.rate(i);
      gaps.push_back(free ? slope_of(gap) : Row(0.0));
      rates.push_back(free ? slope_of(rate) : Row(0.0));
      resistive.push_back(free && feet[i].film ? slope_of(laws_.momentum_slope(body.legs[i].foot, gap, settings.probe) * rate) : Row(0.0));
      smooth.push_back(free ? slope_of(acting_.smooth(i, gap, rate)) : Row(0.0));
      pull.push_back(free ? Row(0.0) : slope_of(structure_force(acting_, i, UP, -acting_.gap(i))));
    }
    for (int i = 0; i < legs(); i++) {  // into the robot's directions
      if (acting_.on(i)) {
        acting_.turn_back(i);
      } else if (feet[i].filmed()) {
        const Jet share = acting_.momentum(i, acting_.clearance(i)) / acting_.mass(i);
        for (int d = 0; d < DIRECTIONS; d++) acting_.w(i, d) = acting_.w(i, d) + acting_.normal(i, d) * share;
      }
    }
    for (const Jet& one : to.x) out.push_back(slope_of(one));
    for (int i = 0; i < legs(); i++) out.insert(out.end(), {slope_of(to.of(to.u, i, ALONG)), slope_of(to.of(to.u, i, UP))});
    for (const Jet& one : to.v) out.push_back(slope_of(one));
    for (int i = 0; i < legs(); i++) out.insert(out.end(), {slope_of(to.of(to.w, i, ALONG)), slope_of(to.of(to.w, i, UP))});
    for (const auto* part : {&gaps, &rates, &resistive, &smooth, &pull}) out.insert(out.end(), part->begin(), part->end());
  }
};

}  // namespace tarsus::legged

// One moment of a legged robot with derivatives: what acts on its feet then, how fast everything changes, and what an impact does.
#pragma once
#include "derive/legged_perturbed.hpp"
#include "derive/shell.hpp"
#include "legged/ground.hpp"

namespace tarsus::legged {

// State at a moment. u, w (legs, directions); grip (legs): as in LeggedFoot. Of uneven ground the facet of every leg, and whether its
// foot lives in the directions of that, which may turn; else in the robot's.
struct JetPlace {
  Jet time = Jet(0.0);
  std::vector<Jet> x, v, u, w;
  std::vector<Grip<Jet>> grip;
  std::vector<FacetOf<Jet>> ground;
  std::vector<uint8_t> on;
  Jet& of(std::vector<Jet>& values, int i, int d) { return values[DIRECTIONS * size_t(i) + d]; }
  const Jet& of(const std::vector<Jet>& values, int i, int d) const { return values[DIRECTIONS * size_t(i) + d]; }
};

// Rates of change [1/s] of all that a run carries on; slipped (legs), energies.
struct Rates {
  std::vector<double> x, v, u, w, slipped;
  Energies power;
};

// What acts at a moment of a robot's run, by laws and drives with derivatives, or with none of their own: what the maps of
// legged/ground.hpp ask for.
class Acting {
 public:
  typedef Jet Real;
  LawTangents& laws;

  static constexpr int directions() { return DIRECTIONS; }

  // copies: perturbed walkers; null where no derivatives are needed.
  Acting(const Legged& s, const Body& unit, LawTangents& l, const DriveTangents& drives, const DataTangents& data,
         const Player& player, const std::vector<PerturbedWalker>* copies)
      : laws(l), s_(s), unit_(unit), drives_(drives), data_(data), player_(player), copies_(copies) {}

  // At the moment of a place, which stays where it is.
  Acting& on(JetPlace& at) {
    at_ = &at;
    return *this;
  }

  // A number of a leg in the robot's directions, with its derivatives from the perturbed copies.
  template <class F>
  Jet of_leg(int i, F&& value) const {
    const auto from = [i, &value](const Legged& s) { return value(s.profile != nullptr ? s.level[i] : s.body.legs[i]); };
    Jet out(from(s_));
    add_own(out, from);
    return out;
  }
  const Leg& leg(int i) const { return s_.body.legs[i]; }
  Jet& u(int i, int d) { return at_->of(at_->u, i, d); }
  Jet& w(int i, int d) { return at_->of(at_->w, i, d); }
  const Jet& u(int i, int d) const { return at_->of(at_->u, i, d); }
  const Jet& w(int i, int d) const { return at_->of(at_->w, i, d); }
  Jet mass(int i) const {
    return of_leg(i, [](const Leg& leg) { return leg.mass; });
  }
  Jet stiffness(int i, int d) const { return on(i) ? mixed(i, &Leg::stiffness).own[d] : level(i, &Leg::stiffness, d); }
  Jet damping(int i, int d) const { return on(i) ? mixed(i, &Leg::damping).own[d] : level(i, &Leg::damping, d); }
  Jet gap(int i) const { return uneven() ? ground(i).gap_of(place(i), height(i)) : height(i); }
  Jet weight(int i, int d) const {
    return turned(i, d, [&](int e) {
      Jet out = jet((uneven() ? s_.level[i] : leg(i)).weight[e], data_.sources[s_.body.feet() + e] * unit_.legs[i].weight[e]);
      add_own(out, [&](const Legged& s) { return (s.profile != nullptr ? s.level[i] : s.body.legs[i]).weight[e]; });
      return out;
    });
  }
  Jet hip(int i, int d) const { return hip(i, d, at_->x); }
  Jet hip_rate(int i, int d) const { return hip(i, d, at_->v); }
  Jet load(int i, int n, int d) const {
    return drive(s_.body.drive[n], at_->time) * turned(i, d, [&](int e) {
      const auto gain = [&](const Legged& s) { return (s.profile != nullptr ? s.level_gain : s.body.gain)[2 * n + e]; };
      Jet out(gain(s_));
      add_own(out, gain);
      return out;
    });
  }
  Jet across(int i, int d) const {
    if (!on(i)) return Jet(0.0);
    const Jet rate = hip_rate(i, 1 - d) - (d == UP ? w(i, ALONG) : Jet(0.0));
    return mixed(i, &Leg::stiffness).cross * (hip(i, 1 - d) - u(i, 1 - d)) + mixed(i, &Leg::damping).cross * rate;
  }
  Jet landing_gap(int) const { return Jet(0.0); }  // a foot that lands is at the ground at its own moment

  // Of uneven ground: facets and their factors below a leg by number, that of a foot, and the corner at an end of its facet.
  bool uneven() const { return s_.profile != nullptr; }
  FacetOf<Jet> facet(int i, int64_t k) const {
    const Profile& line = profile_of(s_, i);
    return line.facet<Jet>(k, [&](int64_t n) { return jet(line.numbers[n], data_.profile[line.first + size_t(n)]); });
  }
  PatchOf<Jet> patch(int i, int64_t k) const {
    const Profile& line = profile_of(s_, i);
    return line.patch<Jet>(k, [&](int64_t n) { return jet(line.numbers[n], data_.profile[line.first + size_t(n)]); });
  }
  const FacetOf<Jet>& ground(int i) const { return at_->ground[i]; }
  bool on(int i) const { return uneven() && at_->on[i]; }
  CornerOf<Jet> corner(int i, int way) const { return {ground(i), facet(i, ground(i).number + way), way}; }
  // Height and place at rest, in the robot's directions.
  Jet height(int i) const { return jet((uneven() ? s_.level[i] : leg(i)).gap, leg(i).foot < 0 ? Row(0.0) : data_.sources[leg(i).foot]); }
  Jet place(int i) const {
    return of_leg(i, [](const Leg& leg) { return leg.place; });
  }
  // Take a foot from the robot's directions into those of its facet, and back.
  void turn(int i) { turn_by(i, ground(i).sin, true); }
  void turn_back(int i) { turn_by(i, -ground(i).sin, false); }
  // Gap of a foot where it is; what a force along the ground's normal does in a direction.
  Jet clearance(int i) const {
    return uneven() && !on(i) ? gap(i) + ground(i).cos * u(i, UP) - ground(i).sin * u(i, ALONG) : u(i, UP) + gap(i);
  }
  Jet normal(int i, int d) const { return uneven() && !on(i) ? (d == UP ? ground(i).cos : -ground(i).sin) : Jet(d == UP ? 1.0 : 0.0); }

  // The film's momentum, from the run's base on; the lanes' own counts from nothing. Events on uneven ground are told of rates with it.
  Jet momentum(int i, const Jet& gap) const {
    return s_.feet[i].film ? laws.momentum(leg(i).foot, gap) - s_.feet[i].base : Jet(0.0);
  }
  Jet film(int i, const Jet& gap) const { return uneven() ? Jet(0.0) : momentum(i, gap); }
  Jet smooth(int i, const Jet& gap, const Jet& rate) const {
    const int f = leg(i).foot;
    return s_.feet[i].force ? laws.force(f, gap, rate, volts(f), at_->time) : Jet(0.0);
  }

  // Channel at a time, in the piece that holds it up to the next kink.
  Jet drive(int c, const Jet& time) const {
    Cursor at = player_.cursor[c];
    const Signals& signals = drives_.signals;
    while (time.value - at.shift > signals.end[at.piece] && !signals.sharp[at.piece] && Player::next_piece(at)) {
    }
    return drives_.value(c, at, time);
  }
  Jet volts(int f) const {
    const int64_t c = laws.laws.volts[f];
    return c < 0 ? Jet(0.0) : drive(int(c), at_->time);
  }
  Jet hip(int i, int d, const std::vector<Jet>& body) const {
    double plain[MOST_COORDINATES];
    for (size_t b = 0; b < body.size(); b++) plain[b] = body[b].value;
    return turned(i, d, [&](int e) {
      const Hip& of = (uneven() ? s_.level[i] : leg(i)).hip[e];
      Jet out(0.0);
      for (int n = 0; n < of.count; n++) out = out + body[of.at[n]] * of.by[n];
      add_own(out, [&](const Legged& s) { return (s.profile != nullptr ? s.level[i] : s.body.legs[i]).hip[e].motion(plain); });
      return out;
    });
  }
  Jet strength(int i) const { return laws.strength(leg(i).foot, at_->time - at_->grip[i].since, volts(leg(i).foot)); }
  Jet age_brought(int i) const { return at_->grip[i].brought(laws, leg(i).foot, at_->time); }
  Bearing<Jet> bearing(int i) const { return bearing_of(*this, i, strength(i)); }
  // Gap rate [m/s] of a free foot.
  Jet rate(int i) const {
    const Jet own = uneven() ? normal(i, UP) * w(i, UP) + normal(i, ALONG) * w(i, ALONG) : w(i, UP);
    return own + momentum(i, clearance(i)) / mass(i);
  }

  // The function that vanishes at an event.
  Jet function(int i, FootEvent kind) const {
    switch (kind) {
      case TOUCH: return clearance(i);
      case STOP: return w(i, ALONG) * s_.feet[i].sense[ALONG];
      case PULL_OFF: return strength(i) - pull_on(*this, i);
      case HIGH_END: return left(i, 1);
      case LOW_END: return left(i, -1);
      default: break;
    }
    const Bearing<Jet> at = bearing(i);
    if (kind == SHIFT || kind == LOOSE) {
      const int way = s_.feet[i].wedged;
      if (kind == LOOSE) return at.along * double(way);
      const CornerOf<Jet> corner = this->corner(i, way);
      return at.margin - at.along * (double(way) * corner.cos / corner.sin);
    }
    return at.most + at.along * (kind == SLIP_UP ? -1.0 : 1.0);
  }

  Rates rates() const {
    const int nb = s_.coordinates();
    Rates out = {std::vector<double>(nb), std::vector<double>(nb), {}, {}, std::vector<double>(s_.legs(), 0.0), {}};
    std::vector<double> push(nb);
    for (int b = 0; b < nb; b++) {
      push[b] = -s_.body.weight[b];
      for (int d = 0; d < s_.body.drives; d++) {
        const double by = s_.body.load[d * nb + b];
        if (by != 0.0) push[b] += by * drive(d, at_->time).value;
      }
      out.x[b] = at_->v[b].value;
      out.power.work += push[b] * out.x[b];
      for (int c = 0; c < nb; c++) {
        const double drag = s_.body.damping[b * nb + c] * at_->v[c].value;
        push[b] -= s_.body.stiffness[b * nb + c] * at_->x[c].value + drag;
        out.power.damping += drag * out.x[b];
      }
    }
    for (int i = 0; i < s_.legs(); i++) add_rates(i, push, out);
    for (int b = 0; b < nb; b++) out.v[b] = push[b] / s_.body.mass[b];
    return out;
  }

  // A foot reaches the ground: its state after what the log says of it, or, ``kind`` 0, after it has just left. pull [N]: on it where it
  // is not held by this facet alone.
  EventNumbers<Jet> land(int i, int kind, const Jet* pull = nullptr) {
    const int f = leg(i).foot;
    Landing<Jet> at = pre_impact(*this, i);
    if (pull != nullptr) at.pull = *pull;
    EventNumbers<Jet> out;
    out.when = at_->time;
    if (kind == 0) {
      w(i, UP) = leaving_rate(*this, i, at.speed.value < 0.0 ? -at.speed : Jet(0.0));
      return out;
    }
    out.pull = at.pull;
    out.strength = at.strength;
    at_->grip[i].begin(laws, f, at_->time);
    if (kind == CONTACT_AT_START) {
      w(i, UP) = Jet(0.0);
      return out;
    }
    post_impact(*this, i, at);
    const Braking<Jet> friction = impact(*this, i, EventKind(kind), at);
    out = numbers_of(laws, f, EventKind(kind), at_->time, at, friction.lost);
    out.doubtful = landing_in_doubt(laws, f, at) || friction.doubtful;
    return out;
  }

 private:
  const Legged& s_;
  const Body& unit_;
  const DriveTangents& drives_;
  const DataTangents& data_;
  const Player& player_;
  const std::vector<PerturbedWalker>* copies_;
  JetPlace* at_ = nullptr;

  template <class F>
  void add_own(Jet& to, F&& value) const {
    if (copies_ == nullptr) return;
    for (const PerturbedWalker& one : *copies_) to.slope[one.lane] += one.weight * value(one.s);
  }

  typedef double (Leg::*Pair)[MOST_DIRECTIONS];
  Jet level(int i, Pair part, int d) const {
    return of_leg(i, [&](const Leg& leg) { return (leg.*part)[d]; });
  }
  Mixed<Jet> mixed(int i, Pair part) const { return {level(i, part, UP), level(i, part, ALONG), ground(i).cos, ground(i).sin}; }
  // Components of a vector, given by ``part`` in the robot's directions, in those that a foot lives in.
  template <class F>
  Jet turned(int i, int d, F&& part) const {
    if (!on(i)) return part(d);
    Jet vector[DIRECTIONS] = {part(UP), part(ALONG)};
    rotate(vector, ground(i).cos, ground(i).sin);
    return vector[d];
  }
  void turn_by(int i, const Jet& sin, bool on) {
    rotate(&u(i, UP), ground(i).cos, sin);
    rotate(&w(i, UP), ground(i).cos, sin);
    at_->on[i] = on;
  }
  // Distance of a foot from an end of its facet, on it or above it.
  Jet left(int i, int way) const {
    const FacetOf<Jet>& facet = ground(i);
    if (on(i)) return (facet.end(way) - u(i, ALONG) - facet.place_of(place(i), height(i))) * double(way);
    const Jet end = facet.end(way) * facet.cos;
    const double past = end_of(s_, i, way) - end.value;  // see float_above
    return (facet.x + end + past - u(i, ALONG) - place(i)) * double(way);
  }

  void add_rates(int i, std::vector<double>& push, Rates& out) const {
    const Leg& leg = this->leg(i);
    const LeggedFoot& foot = s_.feet[i];
    const bool film = foot.film && !foot.held(UP), force = foot.force && !foot.held(UP);
    const double gap = film || force ? clearance(i).value : 0.0, momentum = film ? this->momentum(i, Jet(gap)).value : 0.0;
    double lifted[DIRECTIONS], across[DIRECTIONS], rate[DIRECTIONS] = {}, normal[DIRECTIONS], approach = 0.0;
    for (int d = 0; d < DIRECTIONS; d++) {
      normal[d] = this->normal(i, d).value;
      if (!foot.held(d)) rate[d] = w(i, d).value + normal[d] * momentum / leg.mass;
      lifted[d] = hip(i, d).value - u(i, d).value;
      across[d] = hip_rate(i, d).value - rate[d];
      approach += normal[d] * rate[d];
    }
    const double smooth = force ? this->smooth(i, Jet(gap), Jet(approach)).value : 0.0;
    if (film) out.power.film -= approach * approach * laws.momentum_slope(leg.foot, Jet(gap), s_.settings.probe).value;
    out.power.smooth += smooth * approach;
    out.power.damping += 2.0 * leg.cross_damping * across[UP] * across[ALONG];
    for (int d = 0; d < DIRECTIONS; d++) {
      double gain = 0.0;
      const double pulled = leg.stiffness[d] * lifted[d] + leg.damping[d] * across[d] +
                            leg.cross_stiffness * lifted[1 - d] + leg.cross_damping * across[1 - d];
      if (!foot.held(d)) {
        double own = -weight(i, d).value;
        for (int n = leg.first; n < leg.last; n++) own += load(i, n, d).value;
        double force = pulled + own + smooth * normal[d];
        if (d == ALONG && foot.contact == SLIPPING) force -= rubbed(i, rate[d], out);
        out.power.work += own * rate[d];
        gain = force / leg.mass;
      }
      out.power.damping += leg.damping[d] * across[d] * across[d];
      leg.hip[d].carry(-pulled, push.data());
      out.u.push_back(rate[d]);
      out.w.push_back(gain);
    }
  }

  // Friction [N] on a foot that slides with a rate.
  double rubbed(int i, double rate, Rates& out) const {
    const LeggedFoot& foot = s_.feet[i];
    out.slipped[i] = std::fabs(rate);
    if (foot.sense[ALONG] == 0.0) return 0.0;
    const Jet most = strength(i);
    const double friction = laws.friction(leg(i).foot, most - pull_on(*this, i), most, Jet(std::fabs(rate))).value * foot.sense[ALONG];
    out.power.friction += friction * rate;
    return friction;
  }
};

}  // namespace tarsus::legged

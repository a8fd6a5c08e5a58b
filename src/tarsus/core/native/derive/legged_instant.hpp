// One moment of a legged robot with derivatives: what acts on its feet then, how fast everything changes, and what an impact does.
#pragma once
#include "derive/legged_perturbed.hpp"
#include "derive/shell.hpp"
#include "legged/ground.hpp"

namespace tarsus::legged {

// State at a moment. u, w (legs, directions); grip (legs): as in LeggedFoot.
struct JetPlace {
  Jet time = Jet(0.0);
  std::vector<Jet> x, v, u, w;
  std::vector<Grip<Jet>> grip;
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

  // A number of the structure, with its derivatives from the perturbed copies.
  template <class F>
  Jet of_body(F&& value) const {
    Jet out(value(s_.body));
    add_own(out, value);
    return out;
  }
  const Leg& leg(int i) const { return s_.body.legs[i]; }
  Jet& u(int i, int d) { return at_->of(at_->u, i, d); }
  Jet& w(int i, int d) { return at_->of(at_->w, i, d); }
  const Jet& u(int i, int d) const { return at_->of(at_->u, i, d); }
  const Jet& w(int i, int d) const { return at_->of(at_->w, i, d); }
  Jet mass(int i) const {
    return of_body([&](const Body& b) { return b.legs[i].mass; });
  }
  Jet stiffness(int i, int d) const {
    return of_body([&](const Body& b) { return b.legs[i].stiffness[d]; });
  }
  Jet damping(int i, int d) const {
    return of_body([&](const Body& b) { return b.legs[i].damping[d]; });
  }
  Jet gap(int i) const { return jet(leg(i).gap, leg(i).foot < 0 ? Row(0.0) : data_.sources[leg(i).foot]); }
  Jet weight(int i, int d) const {
    Jet out = jet(leg(i).weight[d], data_.sources[s_.body.feet() + d] * unit_.legs[i].weight[d]);
    add_own(out, [&](const Body& b) { return b.legs[i].weight[d]; });
    return out;
  }
  Jet hip(int i, int d) const { return hip(i, d, at_->x); }
  Jet hip_rate(int i, int d) const { return hip(i, d, at_->v); }
  Jet load(int n, int d) const {
    return drive(s_.body.drive[n], at_->time) * of_body([&](const Body& b) { return b.gain[2 * n + d]; });
  }
  Jet across(int, int) const { return Jet(0.0); }  // there are no derivatives on uneven ground
  Jet landing_gap(int) const { return Jet(0.0); }  // a foot that lands is at the ground at its own moment
  // The film's momentum, from the run's base on; the lanes' own counts from nothing.
  Jet film(int i, const Jet& gap) const {
    return s_.feet[i].film ? laws.momentum(leg(i).foot, gap) - s_.feet[i].base : Jet(0.0);
  }
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
    const Hip& of = s_.body.legs[i].hip[d];
    Jet out(0.0);
    for (int n = 0; n < of.count; n++) out = out + body[of.at[n]] * of.by[n];
    double plain[MOST_COORDINATES];
    for (size_t b = 0; b < body.size(); b++) plain[b] = body[b].value;
    add_own(out, [&](const Body& b) { return b.legs[i].hip[d].motion(plain); });
    return out;
  }
  Jet strength(int i) const { return laws.strength(leg(i).foot, at_->time - at_->grip[i].since, volts(leg(i).foot)); }
  Jet age_brought(int i) const { return at_->grip[i].brought(laws, leg(i).foot, at_->time); }
  Bearing<Jet> bearing(int i) const { return bearing_of(*this, i, strength(i)); }
  // Gap rate [m/s] of a free foot.
  Jet rate(int i) const { return w(i, UP) + film(i, u(i, UP) + gap(i)) / mass(i); }

  // The function that vanishes at an event.
  Jet function(int i, FootEvent kind) const {
    switch (kind) {
      case TOUCH: return u(i, UP) + gap(i);
      case STOP: return w(i, ALONG) * s_.feet[i].sense[ALONG];
      case PULL_OFF: return strength(i) - pull_on(*this, i);
      default: break;
    }
    const Bearing<Jet> at = bearing(i);
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
    for (int i = 0; i < s_.legs(); i++) {
      for (int d = 0; d < DIRECTIONS; d++) add_rates(i, d, push, out);
    }
    for (int b = 0; b < nb; b++) out.v[b] = push[b] / s_.body.mass[b];
    return out;
  }

  // A foot reaches the ground: its state after what the log says of it, or, ``kind`` 0, after it has just left.
  EventNumbers<Jet> land(int i, int kind) {
    const int f = leg(i).foot;
    Landing<Jet> at = pre_impact(*this, i);
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
    for (const PerturbedWalker& one : *copies_) to.slope[one.lane] += one.weight * value(one.s.body);
  }

  void add_rates(int i, int d, std::vector<double>& push, Rates& out) const {
    const Leg& leg = this->leg(i);
    const LeggedFoot& foot = s_.feet[i];
    const double u = this->u(i, d).value, w = this->w(i, d).value;
    const double lifted = hip(i, d).value - u, moved = hip_rate(i, d).value;
    double rate = 0.0, gain = 0.0;
    if (!foot.held(d)) {
      double own = -weight(i, d).value;
      for (int n = leg.first; n < leg.last; n++) own += load(n, d).value;
      double force = leg.stiffness[d] * lifted + leg.damping[d] * moved + own;
      rate = w;
      if (d == UP && foot.film) {
        const Jet g = this->u(i, UP) + gap(i);
        rate += film(i, g).value / leg.mass;
        out.power.film -= rate * rate * laws.momentum_slope(leg.foot, Jet(g.value), s_.settings.probe).value;
      }
      if (d == UP && foot.force) {
        const double more = smooth(i, Jet((this->u(i, UP) + gap(i)).value), Jet(rate)).value;
        force += more;
        out.power.smooth += more * rate;
      }
      if (d == ALONG && foot.contact == SLIPPING) {
        out.slipped[i] = std::fabs(rate);
        if (foot.sense[ALONG] != 0.0) {
          const Jet most = strength(i);
          const double frictional = laws.friction(leg.foot, most - pull_on(*this, i), most, Jet(std::fabs(w))).value * foot.sense[ALONG];
          force -= frictional;
          out.power.friction += frictional * rate;
        }
      }
      out.power.work += own * rate;
      gain = (force - leg.damping[d] * rate) / leg.mass;
    }
    const double across = moved - rate;
    out.power.damping += leg.damping[d] * across * across;
    leg.hip[d].carry(-(leg.stiffness[d] * lifted + leg.damping[d] * across), push.data());
    out.u.push_back(rate);
    out.w.push_back(gain);
  }

};

}  // namespace tarsus::legged

// One moment of a legged robot with derivatives: what acts on its feet then, how fast everything changes, and what an impact does.
#pragma once
#include "derive/legged_beside.hpp"
#include "legged/ground.hpp"

namespace tarsus::legged {

// State at a moment. u, w (legs, directions), since (legs) [s]: as in LeggedFoot.
struct JetPlace {
  Jet time = Jet(0.0);
  std::vector<Jet> x, v, u, w, since;
  Jet& of(std::vector<Jet>& values, int i, int d) { return values[DIRECTIONS * size_t(i) + d]; }
  const Jet& of(const std::vector<Jet>& values, int i, int d) const { return values[DIRECTIONS * size_t(i) + d]; }
};

// Rates of change [1/s] of all that a run carries on; slipped (legs), energies.
struct Rates {
  std::vector<double> x, v, u, w, slipped;
  Energies power;
};

// Numbers of an event, as in the log; doubtful: a decision is within CLOSE of its threshold; corner: friction stops what
// does not move, so that any motion along the ground is stopped from one side only.
struct Struck {
  Jet when, before = Jet(0.0), after = Jet(0.0), pull = Jet(0.0), strength = Jet(0.0), energy = Jet(0.0), adhesion = Jet(0.0);
  bool doubtful = false;
};

inline bool is_close(const Jet& a, const Jet& b) {
  return std::fabs(a.value - b.value) < CLOSE * (std::fabs(a.value) + std::fabs(b.value));
}

// What acts at a moment, by laws and drives with derivatives, or with none of their own.
class Acting {
 public:
  // beside: walkers of other structures; none where derivatives are not asked for.
  Acting(const Legged& s, const Body& unit, LawTangents& laws, const DriveTangents& drives, const DataTangents& data,
         const Player& player, const std::vector<BesideWalker>* beside)
      : s_(s), unit_(unit), laws_(laws), drives_(drives), data_(data), player_(player), beside_(beside) {}

  // A number of the structure, with what it has by the structures beside.
  template <class F>
  Jet of_body(F&& value) const {
    Jet out(value(s_.body));
    add_own(out, value);
    return out;
  }
  Jet mass(int i) const {
    return of_body([&](const Body& b) { return b.legs[i].mass; });
  }

  Jet gap(int i) const {
    const int f = s_.body.legs[i].foot;
    return jet(s_.body.legs[i].gap, f < 0 ? Row(0.0) : data_.sources[f]);
  }
  Jet weight(int i) const { return jet(s_.body.legs[i].weight, data_.sources[s_.body.feet()] * unit_.legs[i].weight); }
  // Channel at a time, in the piece that holds it up to the next kink.
  Jet drive(int c, const Jet& time) const {
    Cursor at = player_.cursor[c];
    const Signals& signals = drives_.signals;
    while (time.value - at.shift > signals.end[at.piece] && !signals.sharp[at.piece] && Player::next_piece(at)) {
    }
    return drives_.value(c, at, time);
  }
  Jet volts(int f, const Jet& time) const {
    const int64_t c = laws_.laws.volts[f];
    return c < 0 ? Jet(0.0) : drive(int(c), time);
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
  // Drive and weight on a foot [N].
  Jet load(const JetPlace& at, int i, int d) const {
    const Leg& leg = s_.body.legs[i];
    Jet force = d == UP ? -weight(i) : Jet(0.0);
    for (int n = leg.first; n < leg.last; n++) force = force + drive(s_.body.drive[n], at.time) * s_.body.gain[2 * n + d];
    add_own(force, [&](const Body& b) {
      double sum = d == UP ? -b.legs[i].weight : 0.0;
      for (int n = b.legs[i].first; n < b.legs[i].last; n++) sum += drive(b.drive[n], at.time).value * b.gain[2 * n + d];
      return sum;
    });
    return force;
  }
  // As structure_force.
  Jet structure(const JetPlace& at, int i, int d, const Jet& u) const {
    const Jet stiffness = of_body([&](const Body& b) { return b.legs[i].stiffness[d]; });
    const Jet damping = of_body([&](const Body& b) { return b.legs[i].damping[d]; });
    return (hip(i, d, at.x) - u) * stiffness + hip(i, d, at.v) * damping + load(at, i, d);
  }
  Jet along(const JetPlace& at, int i) const { return structure(at, i, ALONG, at.of(at.u, i, ALONG)); }
  // The film's momentum, from the run's base on; the lanes' own counts from nothing.
  Jet momentum(int i, const Jet& gap) const {
    return s_.feet[i].film ? laws_.momentum(s_.body.legs[i].foot, gap) - s_.feet[i].base : Jet(0.0);
  }
  Jet force(const JetPlace& at, int i, const Jet& gap, const Jet& rate) const {
    const int f = s_.body.legs[i].foot;
    return s_.feet[i].force ? laws_.force(f, gap, rate, volts(f, at.time), at.time) : Jet(0.0);
  }
  Jet pull(const JetPlace& at, int i) const {
    return structure(at, i, UP, -gap(i)) + force(at, i, Jet(0.0), Jet(0.0));
  }
  Jet strength(const JetPlace& at, int i) const {
    return laws_.value(STRENGTH, s_.body.legs[i].foot, {at.time - at.since[i]});
  }
  Jet friction(int i, const Jet& margin, const Jet& strength) const {
    return laws_.value(FRICTION, s_.body.legs[i].foot, {margin, strength});
  }
  Jet bound(const JetPlace& at, int i) const {
    const Jet most = strength(at, i);
    return friction(i, most - pull(at, i), most);
  }
  // Gap rate [m/s] of a free foot.
  Jet rate(const JetPlace& at, int i) const {
    return at.of(at.w, i, UP) + momentum(i, at.of(at.u, i, UP) + gap(i)) / mass(i);
  }

  // The function that vanishes at an event.
  Jet function(const JetPlace& at, int i, Happening kind) const {
    switch (kind) {
      case TOUCH: return at.of(at.u, i, UP) + gap(i);
      case STOP: return at.of(at.w, i, ALONG) * s_.feet[i].sense;
      case PULL_OFF: return strength(at, i) - pull(at, i);
      default: return bound(at, i) + along(at, i) * (kind == SLIP_UP ? -1.0 : 1.0);
    }
  }

  Rates rates(const JetPlace& at) const {
    const int nb = s_.coordinates();
    Rates out = {std::vector<double>(nb), std::vector<double>(nb), {}, {}, std::vector<double>(s_.legs(), 0.0), {}};
    std::vector<double> push(nb);
    for (int b = 0; b < nb; b++) {
      push[b] = -s_.body.weight[b];
      for (int d = 0; d < s_.body.drives; d++) {
        const double by = s_.body.load[d * nb + b];
        if (by != 0.0) push[b] += by * drive(d, at.time).value;
      }
      out.x[b] = at.v[b].value;
      out.power.work += push[b] * out.x[b];
    }
    for (int i = 0; i < s_.legs(); i++) {
      for (int d = 0; d < DIRECTIONS; d++) add_rates(at, i, d, push, out);
    }
    for (int b = 0; b < nb; b++) out.v[b] = push[b] / s_.body.mass[b];
    return out;
  }

  // A foot reaches the ground: its state after what the log says of it, or, ``kind`` 0, after it has just left.
  Struck strike(JetPlace& at, int i, int kind) const {
    const int f = s_.body.legs[i].foot;
    const Jet mass = this->mass(i), film = momentum(i, Jet(0.0)) / mass;
    Jet &w = at.of(at.w, i, UP), &u = at.of(at.u, i, UP);
    Struck out;
    out.when = at.time;
    const Jet speed = -(w + film);
    u = -gap(i);
    w = Jet(0.0);
    if (kind == 0) {
      w = (speed.value < 0.0 ? -speed : Jet(0.0)) - film;
      return out;
    }
    out.pull = pull(at, i);
    out.strength = laws_.value(STRENGTH, f, {Jet(0.0)});
    at.since[i] = at.time;
    if (kind == CONTACT_AT_START) return out;
    const Jet after = laws_.value(REBOUND, f, {speed});
    const Jet lost = (speed * speed - after * after) * mass * 0.5, kept = after * after * mass * 0.5;
    out.before = speed;
    out.doubtful = in_doubt(f, after, out, printed_pull(at, i, after));
    if (kind == BOUNCE) {
      out.after = after;
      w = after - film;
      out.energy = lost + rub(at, i, speed + after, out);
      return out;
    }
    if (kind == CAPTURE && laws_.has(f, HAS_LATCH)) out.adhesion = kept;
    out.energy = lost + kept + rub(at, i, speed, out);
    if (kind == REST) {  // as rest_time
      out.when = at.time - after * mass * 2.0 / out.pull / (1.0 - after / speed);
    }
    return out;
  }

 private:
  const Legged& s_;
  const Body& unit_;
  LawTangents& laws_;
  const DriveTangents& drives_;
  const DataTangents& data_;
  const Player& player_;
  const std::vector<BesideWalker>* beside_;

  template <class F>
  void add_own(Jet& to, F&& value) const {
    if (beside_ == nullptr) return;
    for (const BesideWalker& one : *beside_) to.slope[one.lane] += one.weight * value(one.s.body);
  }

  void add_rates(const JetPlace& at, int i, int d, std::vector<double>& push, Rates& out) const {
    const Leg& leg = s_.body.legs[i];
    const LeggedFoot& foot = s_.feet[i];
    const double u = at.of(at.u, i, d).value, w = at.of(at.w, i, d).value;
    const double lifted = hip(i, d, at.x).value - u, moved = hip(i, d, at.v).value;
    double rate = 0.0, gain = 0.0;
    if (!foot.held(d)) {
      const double own = load(at, i, d).value;
      double force = leg.stiffness[d] * lifted + leg.damping[d] * moved + own;
      rate = w;
      if (d == UP && foot.film) {
        const Jet g = at.of(at.u, i, UP) + gap(i);
        rate += momentum(i, g).value / leg.mass;
        out.power.film -= rate * rate * laws_.momentum_slope(leg.foot, Jet(g.value), s_.settings.probe).value;
      }
      if (d == UP && foot.force) {
        const Jet g = at.of(at.u, i, UP) + gap(i);
        const double more = this->force(at, i, Jet(g.value), Jet(rate)).value;
        force += more;
        out.power.smooth += more * rate;
      }
      if (d == ALONG && foot.contact == SLIPPING) {
        out.slipped[i] = std::fabs(rate);
        if (foot.sense != 0.0) {
          const double rubs = bound(at, i).value * foot.sense;
          force -= rubs;
          out.power.friction += rubs * rate;
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

  // As impact_friction.
  Jet rub(JetPlace& at, int i, const Jet& change, Struck& out) const {
    Jet& along = at.of(at.w, i, ALONG);
    const Jet before = along, most = friction(i, change, Jet(0.0));
    out.doubtful = out.doubtful || (most.value > 0.0 && is_close(Jet(std::fabs(before.value)), most));
    if (std::fabs(before.value) <= most.value) {
      along = before.value == 0.0 && most.value == 0.0 ? before : Jet(0.0);
    } else {
      along = before.value > 0.0 ? before - most : before + most;
    }
    return (before * before - along * along) * mass(i) * 0.5;
  }

  // The pull by (2.13) as printed, as in ``land``.
  double printed_pull(const JetPlace& at, int i, const Jet& after) const {
    const Leg& leg = s_.body.legs[i];
    return structure(at, i, UP, -gap(i)).value - 2.0 * leg.stiffness[UP] * leg.gap + leg.damping[UP] * after.value;
  }

  bool in_doubt(int f, const Jet& after, const Struck& at, double printed) const {
    if (laws_.has(f, RESTITUTES_FIRST)) {
      const double excess = laws_.value(EXCESS, f, {after}).value;
      if (std::fabs(excess) < CLOSE * std::fabs(after.value)) return true;
      if (excess > 0.0) return false;
    } else if (laws_.has(f, PULL_AS_PRINTED)) {
      return is_close(Jet(printed), Jet(std::max(at.strength.value, 0.0)));
    } else if (!laws_.has(f, HAS_LATCH)) {
      return false;
    }
    return is_close(at.pull, at.strength);
  }
};

}  // namespace tarsus::legged

// Friction on feet whose slides stop at one moment, of all of them at once, so that no order of feet matters.
//
// By Gauss's principle of least constraint: of all forces that friction can bear, those act that leave the least acceleration along the ground. It is what
// an impact leaves the least energy by (march/brake.hpp), with forces for impulses and accelerations for rates. Where the structure leaves feet fewer ways
// than they are, so that a load may lie on any of them, the forces are the least that make these accelerations.
#pragma once
#include "march/brake.hpp"
#include "modal/contact.hpp"

namespace tarsus::modal {

// Friction [N] on a foot that has stopped, and the most that it bears; held, most_held: the force by which the contact
// mode would hold it, and the most that it would bear under such forces.
struct AtRest {
  double force, most, held, most_held;

  // It bears less than it could: the foot sticks. Else it slides against the force.
  bool sticks() const { return std::fabs(force) < most && !is_close(std::fabs(force), most); }

  // Share of the way from the force to the one held at which friction of that sign (+-1) is all that it bears; 2 where it is nowhere.
  double share(double sign) const {
    const double nears = sign * (held - force) - (most_held - most);
    return nears > 0.0 ? std::min((most - sign * force) / nears, 2.0) : 2.0;
  }
  double first_share() const { return std::min(share(1.0), share(-1.0)); }
};

// What friction bears along the ground under the feet that are ``stopping``, most - less F, of the friction F [N] on all of them.
struct Borders {
  Square mobility;  // accelerations along the ground by friction [1/kg]
  Square less;
  std::vector<double> most;

  explicit Borders(Modal& m) : mobility(int(m.stopping.size())), less(mobility.size), most(mobility.size) {
    const int feet = m.sizes.feet, state = m.sizes.state();
    FootSet sliding = m.mode->feet;
    std::vector<double> senses;
    for (int i : m.stopping) {
      sliding.set(feet + i, false);
      senses.push_back(std::exchange(m.feet[i].sense, 0.0));
    }
    in_mode(m, m.book.require(sliding), [&] {
      const std::vector<double> pull = moment_of(m).pull;
      for (int a = 0; a < mobility.size; a++) {
        const int i = m.stopping[a];
        const SlidingBound bound = bound_by_law(m.laws, i, Row(breaking_now(m, i) - pull[i]), Row(m.strength_now(i)), Row(0.0), Row(0.0));
        most[a] = std::max(bound.value[0], 0.0);
        for (int b = 0; b < mobility.size; b++) {
          const double *rate = m.mode->slide_rate + i * state, *slide = m.mode->slide + m.stopping[b] * state;
          for (int k = 0; k < state; k++) mobility.at(a, b) += rate[k] * slide[k];
          less.at(a, b) = bound.slope[MARGIN][0] * m.mode->feed[size_t(i) * m.sizes.inputs() + feet + m.stopping[b]];
        }
      }
      return 0.0;
    });
    for (size_t a = 0; a < senses.size(); a++) m.feet[m.stopping[a]].sense = senses[a];
    for (int a = 0; a < mobility.size; a++) {
      for (int b = 0; b < a; b++) mobility.at(a, b) = mobility.at(b, a) = 0.5 * (mobility.at(a, b) + mobility.at(b, a));
    }
  }
};

// Friction on the feet that are ``stopping``, by the forces that would hold them all [N]. The state is that of the contact mode in which all of them stick.
inline std::vector<AtRest> friction_at_rest(Modal& m, const std::vector<double>& holding) {
  const Borders by(m);
  const int n = by.mobility.size;
  std::vector<double> accelerations = by.mobility.times(holding);  // without friction
  for (double& one : accelerations) one = -one;
  std::vector<uint8_t> free(n);
  Bounds bounds;
  double largest_mobility = 0.0;
  for (int i = 0; i < n; i++) largest_mobility = std::max(largest_mobility, by.mobility.at(i, i));
  for (int i = 0; i < n; i++) {
    free[i] = by.mobility.at(i, i) > NO_PART * largest_mobility;
    std::vector<double> row(n);
    for (int j = 0; j < n; j++) row[j] = by.less.at(i, j);
    for (const double sign : {1.0, -1.0}) {
      std::vector<double> cone = row;
      cone[i] += sign;
      bounds.add(std::move(cone), by.most[i]);
    }
  }
  const std::vector<double> force = LeastEnergy(by.mobility, by.mobility, accelerations, free, bounds).impulses();
  const std::vector<double> taken = by.less.times(force), taken_held = by.less.times(holding);
  std::vector<AtRest> out;
  for (int i = 0; i < n; i++) out.push_back({force[i], std::max(by.most[i] - taken[i], 0.0), holding[i], by.most[i] - taken_held[i]});
  return out;
}

// Whether friction of feet that slide would have no solution, or several, at rest: a slide that slows down, and friction that grows with it, then ends before
// that, at a moment that no step reaches. The state is the flowing one.
inline bool jams_as_it_slows(Modal& m) {
  std::vector<double> senses, by_margin;
  add_film_momenta(m);
  for (int i : m.braked) senses.push_back(std::exchange(m.feet[i].sense, 0.0));
  const std::vector<double> pull = moment_of(m).pull;
  for (size_t k = 0; k < senses.size(); k++) {
    const int i = m.braked[k];
    m.feet[i].sense = senses[k];
    const Row margin(std::fabs(breaking_now(m, i) - pull[i]));
    by_margin.push_back(bound_by_law(m.laws, i, margin, Row(m.strength_now(i)), Row(0.0), Row(0.0)).slope[MARGIN][0]);
  }
  remove_film_momenta(m);
  return !has_one_solution(m, by_margin);
}

}  // namespace tarsus::modal

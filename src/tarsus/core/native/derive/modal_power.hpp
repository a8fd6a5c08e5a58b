// How powers of a modal robot's forces change with the numbers that it has derivatives by: of drives and weight, of dampers, and of
// resistive and smooth forces at the feet, and what friction takes.
#pragma once
#include "derive/tangent.hpp"
#include "record/replay.hpp"

namespace tarsus::modal {

constexpr int POWERS = 5;

// Points of Gauss's quadrature on [0, 1], and the part of a step that they are good for: of products of modes that turn or decay
// by no more than TURN in it they leave 1e-13.
struct GaussPoints {
  std::vector<double> places, weights;
  static constexpr double TURN = 5.0;
};

// Arrays of a structure, or their derivatives by one number. loads (n, drives), weight (n, GRAVITIES), damping (n, n).
struct PowerArrays {
  std::vector<double> loads, weight, damping;
};

class PowerSlopes {
 public:
  Row sums[POWERS] = {};  // derivatives of the energies [J], of all steps so far

  // by: of the numbers of the structure, each with its lane; gravity [m/s^2], and its derivatives.
  // tangents (ways, n): of feet that know their way along the ground.
  PowerSlopes(const Sizes& s, GaussPoints points, PowerArrays own, std::vector<std::pair<int, PowerArrays>> by, const Jet* gravity,
              std::vector<double> tangents)
      : sizes_(s), points_(std::move(points)), own_(std::move(own)), by_(std::move(by)), gravity_{gravity[0], gravity[1]}, tangents_(std::move(tangents)) {}

  // Add what a step gives whose moments at scaled time s are seen by at(s) -> values and their tangents; rate [1/s]: of the
  // fastest mode.
  template <class See>
  void add_step(double length, double fraction, double rate, See&& at) {
    const double parts = std::max(std::ceil(rate * length * fraction / GaussPoints::TURN), 1.0);
    for (double part = 0.0; part < parts; part++) {
      for (size_t g = 0; g < points_.places.size(); g++) {
        const auto [values, tangents] = at((part + points_.places[g]) * fraction / parts);
        add_moment(*values, *tangents, points_.weights[g] * length * fraction / parts);
      }
    }
  }

  // Powers [W] at a moment, which count as often as the moment moves.
  void add_moving(const Shown<double>& at, const Row& by) {
    double damped = 0.0, pushed = 0.0, resisted = 0.0, smoothed = 0.0;
    for (int r = 0; r < sizes_.coordinates; r++) {
      damped += speed(at, r) * along(own_.damping, r, &at.place[sizes_.coordinates]);
      pushed += speed(at, r) * push(own_, at, r);
    }
    for (int i = 0; i < sizes_.feet; i++) {
      resisted += at.resistive[i] * at.rate[i];
      smoothed += at.smooth[i] * at.rate[i];
    }
    double braked = 0.0;
    for (int i = 0; i < sizes_.ways; i++) braked -= at.friction[i] * along(tangents_, i, &at.place[sizes_.coordinates]);
    const double powers[POWERS] = {pushed, damped, resisted, smoothed, braked};
    for (int e = 0; e < POWERS; e++) sums[e] += by * powers[e];
  }

 private:
  const Sizes sizes_;
  const GaussPoints points_;
  const PowerArrays own_;
  const std::vector<std::pair<int, PowerArrays>> by_;
  const Jet gravity_[GRAVITIES];
  const std::vector<double> tangents_;

  double speed(const Shown<double>& at, int r) const { return at.place[sizes_.coordinates + r]; }
  template <class Real>
  Real along(const std::vector<double>& rows, int r, const Real* x) const {
    Real sum = Real(0.0);
    for (int c = 0; c < sizes_.coordinates; c++) sum += x[c] * rows[size_t(r) * sizes_.coordinates + c];
    return sum;
  }
  template <class Real>
  Real load(const PowerArrays& of, const Shown<Real>& at, int r) const {
    Real sum = Real(0.0);
    for (int d = 0; d < sizes_.drives; d++) sum += at.value[2 * sizes_.feet + d] * of.loads[size_t(r) * sizes_.drives + d];
    return sum;
  }
  double push(const PowerArrays& of, const Shown<double>& at, int r) const {
    double sum = load(of, at, r);
    for (int g = 0; g < GRAVITIES; g++) sum += gravity_[g].value * of.weight[GRAVITIES * size_t(r) + g];
    return sum;
  }

  void add_moment(const Shown<double>& at, const Shown<Row>& by, double share) {
    const int n = sizes_.coordinates;
    for (int r = 0; r < n; r++) {
      const double v = speed(at, r);
      const Row& dv = by.place[n + r];
      Row pushed = load(own_, by, r);
      for (int g = 0; g < GRAVITIES; g++) pushed += slope_of(gravity_[g]) * own_.weight[GRAVITIES * size_t(r) + g];
      sums[0] += (pushed * v + dv * push(own_, at, r)) * share;
      sums[1] += (dv * along(own_.damping, r, &at.place[n]) + along(own_.damping, r, &by.place[n]) * v) * share;
      for (const auto& [lane, change] : by_) {
        sums[0].set(lane, sums[0][lane] + push(change, at, r) * v * share);
        sums[1].set(lane, sums[1][lane] + along(change.damping, r, &at.place[n]) * v * share);
      }
    }
    for (int i = 0; i < sizes_.feet; i++) {
      sums[2] += (by.resistive[i] * at.rate[i] + by.rate[i] * at.resistive[i]) * share;
      sums[3] += (by.smooth[i] * at.rate[i] + by.rate[i] * at.smooth[i]) * share;
    }
    for (int i = 0; i < sizes_.ways; i++) {
      const double rate = along(tangents_, i, &at.place[n]);
      sums[4] -= (by.friction[i] * rate + along(tangents_, i, &by.place[n]) * at.friction[i]) * share;
    }
  }
};

}  // namespace tarsus::modal

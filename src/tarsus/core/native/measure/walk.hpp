// Measures of a walk by drive period, from the marks of a walker. Names, units and words are those of tarsus/measure/walking.py.
#pragma once
#include "measure/moments.hpp"
#include "measure/periods.hpp"

namespace tarsus::measure {

constexpr double STANDSTILL = 1e-10;   // [m] stride below which a walker stands: ratios to its stride have no value there
constexpr double AT_MARK = 1.0 - 1e-6;  // a last stretch shorter than this part of a period is a broken one

// Marks (nm,): time [s], surge, lowest and highest heave since the mark before [m]; slipped (nm, m) [m]: path that each foot slid.
struct Marks {
  Values time, surge, lowest, highest, slipped;
  size_t feet = 0;
};

// Walked periods by the marks at their ends.
class Walk {
 public:
  // own: the drive period between marks [s]; each: how many of them one period has.
  Walk(const Marks& marks, double own, int64_t each, const Used& used) : marks_(marks) {
    const int64_t last = int64_t(marks.time.size()) - 1;
    if (last < 0 || used.count == 0) return;
    const bool broken = last > 0 && marks.time[last] - marks.time[last - 1] < own * AT_MARK;
    const int64_t one = std::min(each, last);
    begin_ = used.dropped * each;
    each_ = each;
    if (used.count == 1) {
      begin_ = 0;
      each_ = std::max<int64_t>(one, 1);
      count_ = one > 0 ? 1 : 0;
    } else {
      count_ = std::max<int64_t>(std::min(used.count * each, last - broken) - begin_, 0) / each;
    }
  }

  int64_t count() const { return count_; }
  int64_t begin(int64_t k) const { return begin_ + k * each_; }
  int64_t end(int64_t k) const { return begin(k) + each_; }

  Values stride() const { return grown(marks_.surge); }
  Values mean_speed() const {
    Values out = stride();
    const Values time = grown(marks_.time);
    for (int64_t k = 0; k < count_; k++) out[k] /= time[k];
    return out;
  }
  // length [m]: of the body, 0 where it has none.
  Values body_lengths_per_second(double length) const {
    Values out = mean_speed();
    for (double& value : out) value = length > 0.0 ? value / length : NONE;
    return out;
  }
  Values vertical_amplitude() const {
    Values out(count_);
    for (int64_t k = 0; k < count_; k++) {
      const auto from = begin(k) + 1, to = end(k) + 1;
      out[k] = *std::max_element(marks_.highest.begin() + from, marks_.highest.begin() + to) -
               *std::min_element(marks_.lowest.begin() + from, marks_.lowest.begin() + to);
    }
    return out;
  }
  Values foot_slip(size_t foot) const {
    Values out(count_);
    for (int64_t k = 0; k < count_; k++) out[k] = marks_.slipped[end(k) * marks_.feet + foot] - marks_.slipped[begin(k) * marks_.feet + foot];
    return out;
  }
  Values slip_ratio(size_t foot) const {
    Values out = foot_slip(foot);
    const Values way = stride();
    for (int64_t k = 0; k < count_; k++) {
      const double path = out[k] + std::fabs(way[k]);
      out[k] = path > STANDSTILL ? out[k] / path : NONE;
    }
    return out;
  }

 private:
  const Marks& marks_;
  int64_t begin_ = 0, each_ = 1, count_ = 0;

  Values grown(const Values& values) const {
    Values out(count_);
    for (int64_t k = 0; k < count_; k++) out[k] = values[end(k)] - values[begin(k)];
    return out;
  }
};

// Energy drawn per period [J] over weight [N] times the way per period without its sign; its spread is that of the way in proportion.
inline Summary transport(const Summary& drawn, double weight, const Summary& stride) {
  const double way = std::fabs(stride.value);
  if (!(weight > 0.0 && way > STANDSTILL)) return Summary();
  const double cost = drawn.value / (weight * way);
  return std::isfinite(cost) ? Summary{cost, cost * stride.spread / way, drawn.n} : Summary();
}

inline double max_heave(const Marks& marks) {
  return marks.time.empty() ? NONE : *std::max_element(marks.highest.begin(), marks.highest.end());
}
inline double max_surge(const Marks& marks) {
  double out = NONE;
  for (double surge : marks.surge) out = std::fabs(surge - marks.surge[0]) <= out ? out : std::fabs(surge - marks.surge[0]);
  return out;
}

}  // namespace tarsus::measure

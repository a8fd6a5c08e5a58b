// Measures of one foot: in windows of time between edges, and in its whole run. Names, units and words are those of
// tarsus/measure/periods.py and whole.py.
#pragma once
#include <array>
#include <limits>

#include "measure/foot.hpp"

namespace tarsus::measure {

constexpr double NONE = std::numeric_limits<double>::quiet_NaN();
constexpr double ALWAYS = 0.999999;         // part of a window in contact from which on a foot was never seen to leave the ground
constexpr double BEFORE_EDGE = 1.0 - 1e-12;  // of a time that may be an edge's: what ends there belongs to the window before

using Values = std::vector<double>;

// Number of the last of n + 1 edges at or before a time, -1 before the first.
inline int64_t number(const Values& edges, double time) { return std::upper_bound(edges.begin(), edges.end(), time) - edges.begin() - 1; }

// The window of a time, -1 or n where it is in none: one at the last edge is in the last; or, where ``ended``, one at an edge is in the
// window before, where it got.
inline int64_t window_of(const Values& edges, double time, bool ended) {
  const int64_t count = int64_t(edges.size()) - 1, k = number(edges, ended ? time * BEFORE_EDGE : time);
  if (ended) return time >= edges.front() ? k : -1;
  return k == count && time == edges.back() ? k - 1 : k;
}

class Windows {
 public:
  Windows(const Foot& foot, const Values& edges, const Counting& counting)
      : foot_(foot), edges_(edges), counting_(counting), count_(int64_t(edges.size()) - 1) {}

  Values bounces() const { return began(foot_.bounces(counting_)); }
  Values bounces_per_second() const { return per_length(bounces()); }
  Values rebounds() const { return began(foot_.rebounds(counting_.height)); }
  Values duty_factor() const { return per_length(contact_duration()); }
  Values impacts() const { return total(foot_.impacts, false); }
  Values impact_speed() const { return mean(foot_.impacts); }
  Values hardest_impact() const { return largest(foot_.impacts); }

  // Each stay on the ground is shared out among the windows it meets.
  Values contact_duration() const {
    Values out(count_, 0.0);
    for (const Stay& stay : foot_.contacts(counting_.height)) {
      const double start = std::max(stay.start, edges_.front()), end = std::min(stay.end, edges_.back());
      if (!(end > start)) continue;
      const int64_t last = std::min(number(edges_, end), count_ - 1);
      for (int64_t k = number(edges_, start); k <= last; k++) out[k] += std::min(end, edges_[k + 1]) - std::max(start, edges_[k]);
    }
    return out;
  }

  Values peak() const {
    Values out = largest(foot_.tops), contact;
    for (int64_t k = 0; k < count_; k++) {
      if (!std::isnan(out[k])) continue;
      if (contact.empty()) contact = contact_duration();
      if (contact[k] > ALWAYS * length(k)) out[k] = 0.0;
    }
    return out;
  }

  Values mean_apex() const {
    std::vector<Point> apexes;
    for (int64_t k : foot_.hops(counting_.height)) apexes.push_back({foot_.flights[k].apex_time, foot_.flights[k].apex});
    return mean(apexes);
  }

  Values mean_height() const {
    Values out(count_);
    for (int64_t k = 0; k < count_; k++) out[k] = (foot_.integral_at(edges_[k + 1]) - foot_.integral_at(edges_[k])) / length(k);
    return out;
  }

 private:
  const Foot& foot_;
  const Values& edges_;
  const Counting counting_;
  const int64_t count_;

  double length(int64_t k) const { return edges_[k + 1] - edges_[k]; }
  bool within(int64_t k) const { return k >= 0 && k < count_; }

  Values per_length(Values values) const {
    for (int64_t k = 0; k < count_; k++) values[k] /= length(k);
    return values;
  }
  Values total(const std::vector<Point>& points, bool values) const {
    Values out(count_, 0.0);
    for (const Point& point : points) {
      if (const int64_t k = window_of(edges_, point.time, false); within(k)) out[k] += values ? point.value : 1.0;
    }
    return out;
  }
  Values began(const std::vector<int64_t>& flights) const {
    std::vector<Point> starts;
    for (int64_t k : flights) starts.push_back({foot_.flights[k].start, 0.0});
    return total(starts, false);
  }
  Values mean(const std::vector<Point>& points) const {
    Values out = total(points, true), many = total(points, false);
    for (int64_t k = 0; k < count_; k++) out[k] = many[k] > 0.0 ? out[k] / many[k] : NONE;
    return out;
  }
  Values largest(const std::vector<Point>& points) const {
    Values out(count_, NONE);
    for (const Point& point : points) {
      const int64_t k = window_of(edges_, point.time, true);
      if (within(k) && !(point.value <= out[k])) out[k] = point.value;
    }
    return out;
  }
};

struct PerWindow {
  const char* name;
  Values (Windows::*of)() const;
};

constexpr std::array<PerWindow, 11> PER_WINDOW = {{
    {"bounces", &Windows::bounces}, {"contact_duration", &Windows::contact_duration}, {"peak", &Windows::peak},
    {"mean_apex", &Windows::mean_apex}, {"mean_height", &Windows::mean_height}, {"bounces_per_second", &Windows::bounces_per_second},
    {"rebounds", &Windows::rebounds}, {"duty_factor", &Windows::duty_factor}, {"impacts", &Windows::impacts},
    {"impact_speed", &Windows::impact_speed}, {"hardest_impact", &Windows::hardest_impact},
}};

inline double max_peak(const Foot& foot, const Counting&) {
  double out = NONE;
  for (const Point& top : foot.tops) out = top.value <= out ? out : top.value;
  return out;
}
inline double total_bounces(const Foot& foot, const Counting& counting) { return double(foot.bounces(counting).size()); }
inline double total_rebounds(const Foot& foot, const Counting& counting) { return double(foot.rebounds(counting.height).size()); }
inline double total_rebounds_any_height(const Foot& foot, const Counting&) { return double(foot.rebounds(0.0).size()); }
inline double longest_contact(const Foot& foot, const Counting& counting) {
  double out = 0.0;
  for (const Stay& stay : foot.contacts(counting.height)) out = std::max(out, stay.end - stay.start);
  return out;
}

struct InWholeRun {
  const char* name;
  double (*of)(const Foot&, const Counting&);
};

constexpr std::array<InWholeRun, 5> WHOLE_RUN = {{
    {"max_peak", max_peak}, {"total_bounces", total_bounces}, {"total_rebounds", total_rebounds},
    {"total_rebounds_any_height", total_rebounds_any_height}, {"longest_contact", longest_contact},
}};

}  // namespace tarsus::measure

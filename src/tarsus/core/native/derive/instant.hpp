// One moment at which feet have events: the maps of these, on Jets that move with the moment.
#pragma once
#include "derive/shell.hpp"
#include "derive/structure.hpp"
#include "modal/contact.hpp"

namespace tarsus::modal {

class Instant {
 public:
  typedef Jet Real;

  Book& book;
  const Sizes sizes;
  const ContactMode* mode = nullptr;
  LawTangents& laws;
  const Settings& settings;
  Jet time = Jet(0.0);
  std::vector<Jet> w, drives, since;  // flowing state; values of the channels; begin of the contacts [s]
  std::vector<Jet> aged, parted;                         // as in Grip
  std::vector<Jet> gaps, physical, from_offset, places;  // as in Modal, and Foot::place
  std::vector<double> senses;
  std::vector<uint8_t> frictional, begins;  // as Foot::sense and Modal::frictional; whether a slide begins from rest

  Instant(Book& b, LawTangents& l, const Settings& set, std::vector<Jet> sources, const std::vector<Structural>& structural)
      : book(b), sizes(b.sizes), laws(l), settings(set), w(sizes.state(), Jet(0.0)), since(sizes.feet, Jet(0.0)), aged(since), parted(since),
        gaps(sizes.feet, Jet(0.0)), physical(2 * sizes.coordinates, Jet(0.0)), from_offset(physical), places(gaps),
        senses(sizes.feet, 0.0), frictional(sizes.feet, 0), begins(frictional), sources_(std::move(sources)),
        slid_(sizes.feet, -INF), structural_(structural) {}

  // Project the displacements and velocities ``physical`` on a contact mode.
  void enter(const ContactMode& to) {
    for (int i : to.stuck) {
      if (mode == nullptr || !mode->is_stuck[i]) places[i] = book.place_along(i, physical);
    }
    set_mode(to);
    project(*this);
    remove_film_momenta(*this, [](int, const Jet&) {});
  }

  void set_mode(const ContactMode& to) {
    mode = &to;
    derived_.clear();
    for (const Structural& one : structural_) derived_.push_back(one.book->mode(to).rows.get());
  }

  // ---- the interface of the maps of modal/contact.hpp

  Jet* state() { return w.data(); }
  // A number of the contact mode's arrays, with its derivatives by the structure.
  Jet entry(ModeArray array, size_t at) const {
    Jet out((mode->*array)[at]);
    for (size_t n = 0; n < derived_.size(); n++) out.slope[structural_[n].lane] = (derived_[n]->*array)[at];
    return out;
  }
  Jet product(ModeArray array, size_t at, const Jet& by) const {
    return derived_.empty() ? by * (mode->*array)[at] : by * entry(array, at);
  }
  Jet along(ModeArray rows, int row) const {
    Jet sum(0.0);
    for (int k = 0; k < sizes.state(); k++) sum = sum + product(rows, size_t(row) * sizes.state() + k, w[k]);
    return sum;
  }
  void shift(ModeArray rows, int row, const Jet& by) {
    for (int k = 0; k < sizes.state(); k++) w[k] = w[k] + product(rows, size_t(row) * sizes.state() + k, by);
  }
  // A foot that lands is at the ground at its own moment.
  Jet gap_of(int i) const {
    if (i == landing_) return Jet(0.0);
    Jet gap = along(&ContactMode::outputs, i) + feed_bias(i);
    for (int k : mode->stuck) gap = gap + product(&ContactMode::feed, size_t(i) * sizes.inputs() + sizes.feet + k, places[k]);
    return gap;
  }
  Jet rate_of(int i) const { return along(&ContactMode::outputs, sizes.feet + i); }
  Jet feed_bias(int i) const { return biased(&ContactMode::bias_feed, 2 * sizes.feet, i); }
  Jet place_of(int i) const { return places[i]; }
  double sense_of(int i) const { return senses[i]; }
  Jet strength_now(int i) { return laws.strength(i, time - since[i], volts_now(i)); }
  Jet held_bias(int i) const { return biased(&ContactMode::bias_held, sizes.feet, i); }
  Jet printed_bias(int i) const { return biased(&ContactMode::bias_printed, sizes.feet, i); }
  Jet place_bias(int r) const { return biased(&ContactMode::bias_offset, 2 * sizes.coordinates, r); }
  Jet rate_by_jump(int impacted, int foot) const {
    Jet sum(0.0);
    for (int k = 0; k < sizes.state(); k++) {
      const size_t row = size_t(sizes.feet + foot) * sizes.state() + k, jump = size_t(impacted) * sizes.state() + k;
      sum = sum + entry(&ContactMode::outputs, row) * entry(&ContactMode::jump, jump);
    }
    return sum;
  }
  Jet age_brought(int foot) const { return laws.remaining(foot, aged[foot], time - parted[foot]); }
  Jet drive_now(int d) const { return drives[d]; }
  Jet film(int i, const Jet& gap) const { return laws.momentum(i, gap); }
  Jet force_now(int i, const Jet& gap, const Jet& rate) const {
    return laws.force(i, gap, rate, volts_now(i), time);
  }
  Jet volts_now(int i) const {
    const int64_t c = laws.laws.volts[i];
    return c < 0 ? Jet(0.0) : drives[c];
  }

  // ----

  // Gap rate [m/s] of a foot at the ground.
  double rate_at_ground(int i) {
    landing_ = i;
    const double out = modal([&] { return rate_of(i).value; });
    landing_ = -1;
    return out;
  }

  // Take the state along to a moment that moves otherwise.
  void shift_moment(const Row& by) {
    const int m = sizes.feet;
    const std::vector<int> acting = acting_inputs(*mode, laws.plain());
    std::vector<double> values(sizes.inputs(), 0.0), plain, sources, rate;
    for (const Jet& one : w) plain.push_back(one.value);
    for (const Jet& one : sources_) sources.push_back(one.value);
    modal([&] {
      for (int i : acting) {
        values[i] = i < m ? film(i, gaps[i]).value
                    : i < 2 * m && !mode->is_held[i - m] ? force_now(i - m, gaps[i - m], rate_of(i - m)).value
                    : i >= 2 * m ? drives[i - 2 * m].value : 0.0;
      }
      const std::vector<Jet> friction = sizes.ways > 0 ? moment_of(*this).friction : std::vector<Jet>();
      for (int i : mode->sliding) values[m + i] = friction[i].value;
      for (int i : mode->stuck) values[m + i] = places[i].value;
      return 0.0;
    });
    rate_of_state(*mode, acting, plain, values, sources, rate);
    for (int k = 0; k < sizes.state(); k++) w[k] = jet(w[k].value, slope_of(w[k]) + by * rate[k]);
    time = jet(time.value, slope_of(time) + by);
  }

  // Whether a foot that lands and one that has just bounced leave each other's velocity as it is.
  bool independent(int foot, int other) const {
    if (mode->is_held[other]) return false;
    return std::fabs(mode->rate_by_jump(other, foot)) <= 1e-12;
  }

  // Apply an event of the log; ``reported``: whether the log has its strength (of a foot detached by an impact it has none).
  EventNumbers<Jet> apply(EventKind kind, int foot, bool reported) {
    EventNumbers<Jet> out;
    out.when = time;
    if (kind == SLIP_BEGINS || kind == STICK_BEGINS) return slide(kind, foot, reported);
    if (kind == RELEASE) {
      if (reported) out.pull = out.strength = strength_now(foot);
      aged[foot] = time - since[foot];
      parted[foot] = time;
      add_film_momenta(*this);
      senses[foot] = 0.0;
      go(foot, false, false);
      return out;
    }
    if (kind == CONTACT_AT_START) {
      add_film_momenta(*this);
      out.pull = pull_if_held(*this, foot);
      out.strength = new_strength(*this, foot);
      since[foot] = time - age_brought(foot);
      put_down(foot);
      return out;
    }
    return land(kind, foot);
  }

 private:
  std::vector<Jet> sources_;
  std::vector<double> slid_;  // [s] when a foot last began to slide, turned or stuck
  const std::vector<Structural>& structural_;
  std::vector<const ContactMode*> derived_;  // rows of the mode by each number of the structure
  int landing_ = -1;                         // a foot that lands now

  // How a contact mode's outputs and the like move with rest gaps and gravity.
  Jet biased(ModeArray unit, int count, int row) const {
    Jet sum(0.0);
    for (int q = 0; q < sizes.sources(); q++) sum = sum + product(unit, size_t(q) * count + row, sources_[q]);
    return sum;
  }

  // What something is by the modal state.
  template <class Ask>
  double modal(Ask&& ask) {
    const std::vector<Jet> flowing = w;
    add_film_momenta(*this);
    const double out = ask();
    w = flowing;
    return out;
  }

  // From the modal state to the contact mode in which a foot is on the ground or not, and sticks there or not.
  void go(int foot, bool held, bool sticks) {
    find_physical(*this);
    enter(book.with_foot(*mode, foot, held, sticks));
  }

  // To the one with a foot on the ground, which sticks if it has nothing along it: what braking leaves of that is rounding.
  void put_down(int foot) {
    constexpr double SLOW = 1e5, LEFT = 1e-10;  // of a speed that is zero for a run, and of the speeds that it is made of
    begins[foot] = 0;
    bool sticks = false;
    if (frictional[foot]) {
      const Mobilities<Jet> by = mobilities_of(*this, foot);
      const double own = along(&ContactMode::slide_rate, foot).value;
      const double stopped = by.normal.value > 0.0 ? by.across.value / by.normal.value * rate_of(foot).value : 0.0;
      const Footing on(true, own - stopped, SLOW * settings.speed_zero + LEFT * (std::fabs(own) + std::fabs(stopped)));
      sticks = on.sticks;
      senses[foot] = on.sense;
    }
    go(foot, true, sticks);
  }

  // A slide begins, ends or turns; not ``reported``: by an impact on another foot, and without numbers of its own.
  EventNumbers<Jet> slide(EventKind kind, int foot, bool reported) {
    EventNumbers<Jet> out;
    out.when = time;
    add_film_momenta(*this);
    const bool stuck = mode->is_stuck[foot];
    if (!stuck && kind == SLIP_BEGINS && !reported) {  // turned by an impact
      senses[foot] = -senses[foot];
      remove_film_momenta(*this, [](int, const Jet&) {});
      return out;
    }
    if (!stuck) {
      go(foot, true, true);
      add_film_momenta(*this);
    }
    if (reported) {
      const Bearing<Jet> at = bearing_of(*this, foot);
      out.pull = at.along;
      out.strength = at.most;
      const double pulled = sense_of_slip(at.along.value);
      const bool at_once = !stuck && slid_[foot] == time.value;  // as `stick_or_turn`: it slides against what pulls it
      senses[foot] = kind == STICK_BEGINS ? 0.0 : at_once ? -pulled : pulled;
    }
    slid_[foot] = time.value;
    begins[foot] = reported && kind == SLIP_BEGINS;
    if (kind == SLIP_BEGINS) {
      go(foot, true, false);
    } else {
      remove_film_momenta(*this, [](int, const Jet&) {});
    }
    return out;
  }

  EventNumbers<Jet> land(EventKind kind, int foot) {
    landing_ = foot;
    add_film_momenta(*this);
    const Landing<Jet> at = landing_of(*this, foot);
    const Braking<Jet> braked = follow_landing(*this, foot, kind, at);
    EventNumbers<Jet> out = numbers_of(laws, foot, kind, time, at, braked.lost);
    out.doubtful = landing_in_doubt(laws, foot, at) || braked.doubtful;
    if (kind == BOUNCE) {
      remove_film_momenta(*this, [](int, const Jet&) {});
    } else {
      since[foot] = time - age_brought(foot);
      put_down(foot);
    }
    landing_ = -1;
    return out;
  }
};

}  // namespace tarsus::modal

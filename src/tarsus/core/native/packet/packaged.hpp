// A plan and one row of its data out of a packet: run without Python, as a page does, again and again with other numbers.
#pragma once
#include <memory>

#include "legged/run.hpp"
#include "legged/unpack.hpp"
#include "march/start.hpp"
#include "march/unpack.hpp"
#include "modal/make.hpp"
#include "modal/run.hpp"
#include "modal/unpack.hpp"
#include "packet/page_measures.hpp"
#include "packet/packet.hpp"
#include "packet/page_samples.hpp"

namespace tarsus {

// The book of a packet that holds the contact modes which a run may meet: "mode.", a bit for each constraint from the first on, and
// the name of an array.
struct PacketBook : modal::Book {
  const Packet& packet;
  const Nodes& nodes;

  PacketBook(const Packet& p, const Nodes& n) : PacketBook(p, PartOf(p, "book."), n) {}

  const modal::ContactMode& make(const modal::FootSet& feet) override {
    std::string head = "mode.";
    for (int i = 0; i < sizes.constraints(); i++) head += feet.has(i) ? '1' : '0';
    if (!packet.has(head + ".blocks")) throw std::invalid_argument("the packet lacks the contact " + head);
    auto mode = contact_mode_of(PartOf(packet, head + "."), *this, feet, classes());
    finish_mode(*mode, lengths);
    return keep(std::move(mode));
  }
  std::unique_ptr<modal::StepClass> new_step(const modal::ContactMode& mode, int k) override {
    return make_step_tables(mode, lengths, k, nodes);
  }

 private:
  PacketBook(const Packet& p, const Fields& own, const Nodes& n)
      : Book(modal::sizes_of(own), own.doubles("lengths"), own.doubles("tangents"), {}), packet(p), nodes(n) {}
};

// The memory of the packet belongs to whoever gave it, who may change numbers of its row (rows.*) between runs.
class Packaged {
 public:
  // What the last run left: code; finish: end time [s], steps, rejected steps; samples, width of each (see modal::sample_width and
  // LeggedMarch::sample), at the times asked for; marks of a walker; or why it could not start.
  int code = DONE;
  double finish[3] = {};
  std::vector<Event> events;
  std::vector<double> samples, marks, frames;
  size_t width = 0, seen_width = 0;
  std::vector<Refusal> refused;
  std::vector<measure::Summary> measures;  // of the names of `measure_names`

  Packaged(char* at, size_t bytes)
      : packet_(at, bytes), nodes_(nodes_of(PartOf(packet_, "nodes."))), signals_(signals_of(PartOf(packet_, "signals."))),
        laws_(laws_of(PartOf(packet_, "laws."))), rules_(PartOf(packet_, "start.")), settings_(settings_of(PartOf(packet_, "settings."))),
        acting_(laws_), end_(settings_.end) {
    if (packet_.has("book.feet")) {
      book_ = std::make_unique<PacketBook>(packet_, nodes_);
    } else {
      body_ = legged::body_of(PartOf(packet_, "body."));
      tables_ = std::make_unique<legged::LegTables>(nodes_, packet_.doubles("legs.mass"), packet_.doubles("legs.stiffness"),
                                                    packet_.doubles("legs.damping"), packet_.doubles("legs.lengths"));
    }
    const size_t feet = book_ != nullptr ? size_t(book_->sizes.feet) : size_t(body_.feet());
    Fields::check("feet", feet == size_t(laws_.feet) && feet == rules_.m);
    row();
  }
  Packaged(const Packaged&) = delete;

  double duration() const { return end_; }
  // How far runs go from now on [s], at most to the packet's own end: a part of a run is its beginning.
  void until(double time) { settings_.end = std::min(time, end_); }
  size_t feet() const { return rules_.m; }

  // times [s]: increasing; energies: whether a walker's are summed up, which a page does not show.
  void run(const std::vector<double>& times, bool energies = true) {
    refused.clear();
    const Starting own = row();
    set_up(rules_, acting_, signals_, own, 0.0, refused);
    events.clear();
    samples.clear();
    marks.clear();
    if (!refused.empty()) return;
    const RunData data{own.parameters, own.initial, own.sources, own.scales, own.channels};
    book_ != nullptr ? run_by_modes(data, times) : walk(data, times, energies);
  }

  // The same, with its measures, and rows of what a page shows of it (see PageSamples), of a packet that says what these are.
  void show(const std::vector<double>& times) {
    run(times, false);
    frames.clear();
    measures.clear();
    if (!refused.empty()) return;
    const PageSamples shown(packet_);
    shown.check(rules_, signals_);
    seen_width = shown.width(feet());
    const Starting own = row();
    acting_.take(own.parameters);
    Player driven(signals_, nodes_, channels()), volts(signals_, nodes_, packet_.size("rows.shown"));
    driven.restart(own.channels);
    volts.restart(packet_.at<int64_t>("rows.shown", packet_.size("rows.shown")));
    Ages ages(events, acting_, feet());
    PageFrame at(rules_.n, feet());
    for (size_t k = 0; k < times.size() && times[k] <= finish[0]; k++) {
      at.time = times[k];
      for (int c = 0; c < driven.channels(); c++) driven.seek(c, at.time);
      for (int d = 0; d < volts.channels(); d++) volts.seek(d, at.time);
      book_ != nullptr ? frame_of_modes(&samples[k * width], at) : frame_of_walker(&samples[k * width], own, shown, driven, at);
      ages.seek(at.time);
      shown.add(rules_, at, acting_, ages, volts, driven, frames);
    }
    const size_t body = book_ != nullptr ? 0 : size_t(body_.coordinates());
    const size_t names = measure_names(body > 0).size();
    const double* gravity = own.sources + rules_.m;
    const double weight = *packet_.at<double>("measure.mass", 1) * std::hypot(gravity[0], gravity[1]);
    measures = page_measures({events, feet(), own.scales[2], finish[0], marks, body, *packet_.at<double>("measure.length", 1), weight,
                       *packet_.at<double>("rows.drawn", 1), packet_.at<int64_t>("measure.worst", names)});
  }

 private:
  Packet packet_;
  Nodes nodes_;
  Signals signals_;
  Laws laws_;
  StartRules rules_;
  Settings settings_;
  ActingLaws acting_;
  double end_;
  std::unique_ptr<PacketBook> book_;
  legged::Body body_;
  std::unique_ptr<legged::LegTables> tables_;

  size_t channels() const { return packet_.size("rows.channels"); }

  // The row of data as it is now.
  Starting row() const {
    const int64_t* chosen = packet_.at<int64_t>("rows.channels", channels());
    Fields::check("rows.channels", channels() >= rules_.drives);
    for (size_t c = 0; c < channels(); c++) Fields::check("rows.channels", chosen[c] >= 0 && chosen[c] < signals_.channels());
    return {packet_.at<double>("rows.parameters", size_t(std::max(laws_.feet, 1)) * laws_.columns), packet_.at<double>("rows.sources", rules_.m + GRAVITIES),
            packet_.at<double>("rows.idle", rules_.drives), chosen, packet_.at<double>("rows.initial", 2 * rules_.n),
            packet_.at<double>("rows.scales", 3)};
  }

  void run_by_modes(const RunData& data, const std::vector<double>& times) {
    modal::ModalResult out = modal::run_modal({*book_, nodes_, signals_, laws_, settings_, channels()}, {data}, {}, {{times.data(), times.size()}}, false);
    code = int(out.codes[0]);
    std::copy(out.finish.begin(), out.finish.end(), finish);
    events = std::move(out.events);
    width = out.sample_width;
    samples = std::move(out.samples);
  }

  void frame_of_modes(const double* from, PageFrame& at) const {
    const size_t n = rules_.n, m = rules_.m, ways = size_t(book_->sizes.ways);
    std::copy(from, from + n, at.x.begin());
    std::copy(from + n, from + 2 * n, at.v.begin());
    const double* foot = from + 2 * n;  // gap, rate, resistive, smooth, pull, contact, friction
    for (size_t i = 0; i < m; i++) {
      at.gap[i] = foot[i];
      at.rate[i] = foot[m + i];
      at.pull[i] = foot[4 * m + i];
      at.state[i] = foot[5 * m + i];
      if (i >= ways) continue;
      at.friction[i] = foot[6 * m + i];
      at.sense[i] = at.friction[i] > 0.0 ? -1.0 : at.friction[i] < 0.0 ? 1.0 : 0.0;
      double place = 0.0, speed = 0.0;
      for (size_t r = 0; r < n; r++) {
        place += book_->tangents[i * n + r] * at.x[r];
        speed += book_->tangents[i * n + r] * at.v[r];
      }
      at.along[i] = place;
      at.speed[i] = std::fabs(speed);
    }
  }

  void frame_of_walker(const double* from, const Starting& own, const PageSamples& shown, const Player& driven, PageFrame& at) const {
    const size_t nb = size_t(body_.coordinates()), nl = body_.legs.size(), m = rules_.m;
    const double *legs = from + 2 * nb, *footing = legs + 4 * nl;  // of a leg: height, its rate, way along, its rate
    std::copy(from, from + nb, at.x.begin());
    std::copy(from + nb, from + 2 * nb, at.v.begin());
    for (size_t l = 0; l < nl; l++) {
      const double* leg = legs + 4 * l;
      at.x[nb + 2 * l] = leg[2];
      at.x[nb + 2 * l + 1] = leg[0];
      at.v[nb + 2 * l] = leg[3];
      at.v[nb + 2 * l + 1] = leg[1];
    }
    std::vector<double> drives(rules_.drives);
    for (size_t d = 0; d < drives.size(); d++) drives[d] = driven.value(int(d), at.time);
    for (size_t i = 0; i < m; i++) {
      const size_t l = size_t(body_.leg[i]);
      const double* leg = legs + 4 * l;
      at.gap[i] = own.sources[i] + leg[0];
      at.rate[i] = leg[1];
      at.along[i] = leg[2];
      at.speed[i] = std::fabs(leg[3]);
      at.state[i] = footing[i];
      at.sense[i] = footing[m + i];
      if (at.state[i] == AIR) continue;
      at.pull[i] = shown.onto(rules_, own, drives, at, nb + 2 * l + 1);
      at.friction[i] = -shown.onto(rules_, own, drives, at, nb + 2 * l);
    }
  }

  void walk(const RunData& data, const std::vector<double>& times, bool energies) {
    legged::LeggedResult out = legged::run_legged({body_, *tables_, nodes_, signals_, laws_, settings_, channels()}, {data}, {},
                                                  {{times.data(), times.size()}}, energies);
    code = int(out.codes[0]);
    std::copy(out.finish.begin(), out.finish.end(), finish);
    events = std::move(out.events);
    width = out.sample_width;
    samples = std::move(out.samples);
    marks = std::move(out.marks);
  }
};

}  // namespace tarsus

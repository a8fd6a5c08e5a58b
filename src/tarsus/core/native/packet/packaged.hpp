// A plan and one row of its data out of a packet: run without Python, as a page does, again and again with other numbers.
#pragma once
#include <memory>

#include "legged/march.hpp"
#include "legged/unpack.hpp"
#include "march/start.hpp"
#include "march/unpack.hpp"
#include "modal/make.hpp"
#include "modal/run.hpp"
#include "modal/unpack.hpp"
#include "packet/packet.hpp"
#include "record/samples.hpp"

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
      : Book(modal::sizes_of(own), own.doubles("lengths"), own.doubles("tangents")), packet(p), nodes(n) {}
};

// The memory of the packet belongs to whoever gave it, who may change numbers of its row (rows.*) between runs.
class Packaged {
 public:
  // What the last run left: code; finish: end time [s], steps, rejected steps; samples, width of each (see sample_steps and
  // LeggedMarch::sample), at the times asked for; marks of a walker; or why it could not start.
  int code = DONE;
  double finish[3] = {};
  std::vector<Event> events;
  std::vector<double> samples, marks;
  size_t width = 0;
  std::vector<Refusal> refused;

  Packaged(char* at, size_t bytes)
      : packet_(at, bytes), nodes_(nodes_of(PartOf(packet_, "nodes."))), signals_(signals_of(PartOf(packet_, "signals."))),
        laws_(laws_of(PartOf(packet_, "laws."))), rules_(PartOf(packet_, "start.")), settings_(settings_of(PartOf(packet_, "settings."))),
        acting_(laws_) {
    if (packet_.has("book.feet")) {
      book_ = std::make_unique<PacketBook>(packet_, nodes_);
    } else {
      body_ = legged::body_of(PartOf(packet_, "body."));
      tables_ = std::make_unique<legged::LegTables>(nodes_, packet_.doubles("legs.mass"), packet_.doubles("legs.stiffness"),
                                                    packet_.doubles("legs.damping"), packet_.doubles("legs.lengths"));
      between_ = std::make_unique<legged::Between>(nodes_);
    }
    const size_t feet = book_ != nullptr ? size_t(book_->sizes.feet) : size_t(body_.feet());
    Fields::check("feet", feet == size_t(laws_.feet) && feet == rules_.m);
    row();
  }
  Packaged(const Packaged&) = delete;

  double duration() const { return settings_.end; }

  // times [s]: increasing.
  void run(const std::vector<double>& times) {
    refused.clear();
    const Starting own = row();
    set_up(rules_, acting_, signals_, own, 0.0, refused);
    events.clear();
    samples.clear();
    marks.clear();
    if (!refused.empty()) return;
    const RunData data{own.parameters, own.initial, own.sources, own.scales, own.channels};
    book_ != nullptr ? run_by_modes(data, times) : walk(data, times);
  }

 private:
  Packet packet_;
  Nodes nodes_;
  Signals signals_;
  Laws laws_;
  StartRules rules_;
  Settings settings_;
  ActingLaws acting_;
  std::unique_ptr<PacketBook> book_;
  legged::Body body_;
  std::unique_ptr<legged::LegTables> tables_;
  std::unique_ptr<legged::Between> between_;

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
    modal::ModalResult out = modal::run_modal(*book_, nodes_, signals_, laws_, settings_, {data}, channels(), {});
    code = int(out.codes[0]);
    std::copy(out.finish.begin(), out.finish.end(), finish);
    events = std::move(out.events);
    width = modal::sample_width(book_->sizes);
    samples = modal::sample_steps(*book_, nodes_, data.sources, out.trace.data(), out.trace.size() / modal::recorded_width(book_->sizes), times.data(), times.size());
  }

  void walk(const RunData& data, const std::vector<double>& times) {
    Log log;
    legged::Notes notes;
    notes.times = times;
    legged::LeggedMarch system(body_, *tables_, nodes_, *between_, signals_, laws_, settings_, log, notes, settings_.record, channels());
    width = system.sample_width();
    notes.samples.assign(times.size() * width, NOT_A_NUMBER);
    system.begin(data);
    code = march(system);
    finish[0] = system.clock.time;
    finish[1] = double(system.clock.steps);
    finish[2] = double(system.clock.rejected);
    events = std::move(log.events);
    samples = std::move(notes.samples);
    marks = std::move(notes.marks);
  }
};

}  // namespace tarsus

// The maps of a run's instants as matrices: what states, contacts and the numbers of the events after one depend on before it.
//
// They are made eight directions at a time by the maps that tangents take (derive/modal.hpp); a run has few instants for its
// steps, and few directions enter one.
#pragma once
#include "derive/adjoint_step.hpp"
#include "derive/modal.hpp"

namespace tarsus::modal {

// What may move before an instant, one number after the other: the moment that it shares with what was there just before it;
// the gap or pull that its own moment depends on, at a fixed time; the flowing state (at the start of a run the place);
// since when feet are held; values of the channels; sources; groups of parameters of the laws.
struct Directions {
  int since, channels, sources, groups, count;
  static constexpr int SHARED = 0, MARGIN = 1, STATE = 2;

  Directions(const Sizes& s, size_t driven, int parameters)
      : since(STATE + s.state()), channels(since + s.feet), sources(channels + int(driven)), groups(sources + s.sources()),
        count(groups + parameters) {}
  int blocks() const { return (count + LANES - 1) / LANES; }
};

constexpr int TOLD = 8;  // numbers of an event: those of EventNumbers, and the moment at which a flight begins

// Eight of the directions, from ``first`` on.
class Lens : public ModalTangent {
 public:
  TangentResult told;

  Lens(Book& book, const Nodes& nodes, const Halves& halves, const Signals& signals, const Laws& laws, const Settings& settings,
       const RunData& run, const Beginning& start, const DataTangents& data, size_t channels, const Directions& of, int first)
      : ModalTangent(book, nodes, halves, signals, laws, settings, run, start, data, channels, {}), of_(of), first_(first) {}

  static DataTangents data(const DataTangents& nothing, const Directions& of, int first, const std::vector<int64_t>& groups) {
    DataTangents out = nothing;
    const auto mark = [&](std::vector<Row>& rows, int begin, int stride, int offset) {
      for (size_t k = 0; k * stride + offset < rows.size(); k++) rows[k * stride + offset] = unit(begin + int(k) - first);
    };
    mark(out.initial, Directions::STATE, 1, 0);
    mark(out.since, of.since, 1, 0);
    mark(out.changes, of.channels, 3, 1);  // an offset moves the value alone
    mark(out.sources, of.sources, 1, 0);
    for (size_t k = 0; k < groups.size(); k++) {
      if (groups[k] >= 0) out.parameters[k] = unit(of.groups + int(groups[k]) - first);
    }
    return out;
  }

  static Row unit(int lane) {
    Row out = Row(0.0);
    if (0 <= lane && lane < LANES) out.set(lane, 1.0);
    return out;
  }

  void follow(const RunRecord& record) {
    told.events.assign(record.count * EVENT_WIDTH, Row(0.0));
    record_ = &record;
    out_ = &told;
  }

  // Where the run is: a step of it that another has taken.
  void take_from(const Lens& run) {
    step_ = run.step_;
    tables_ = run.tables_;
    gaps_ = run.gaps_;
    value_ = run.value_;
    acting_ = run.acting_;
    drives_.player.cursor = run.drives_.player.cursor;
  }

  void begin(const Lens& run, size_t event, size_t steps, bool shared) {
    if (&run != this) {
      take_from(run);
      end_ = run.end_;
      rate_ = run.rate_;
      shared_at_ = run.shared_at_;
    }
    now_.time = Jet(run.now_.time.value);
    for (int k = 0; k < sizes_.state(); k++) dw_[k] = unit(Directions::STATE + k - first_);
    for (int i = 0; i < sizes_.feet; i++) now_.since[i] = jet(now_.since[i].value, unit(of_.since + i - first_));
    struck_.clear();
    event_ = event;
    first_foot_ = first_foot(event, steps);
    shared_ = unit(Directions::SHARED - first_);
    if (!shared) meet(event, first_foot_, unit(Directions::MARGIN - first_));
    depart();
  }

  void happen(size_t event, std::vector<Row>& to) {
    event_ = event;
    apply(event);
    const Row* numbers = &told.events[event * EVENT_WIDTH];
    to.push_back(numbers[0]);
    to.insert(to.end(), numbers + 3, numbers + 9);
    to.push_back(feet_[int(record_->events[event].foot)].apex_time);
  }

  // What comes out at the end of an instant but for its events: states come with the next step.
  void leave(std::vector<Row>& to) const {
    to.push_back(shared_);
    for (int i = 0; i < sizes_.feet; i++) to.push_back(slope_of(now_.since[i]));
  }
  void arrive(std::vector<Row>& to) {
    end_instant();
    to.insert(to.end(), dw_.begin(), dw_.end());
  }

 protected:
  const Directions& of_;
  const int first_;
};

// One instant, after so many steps: its events but for marks; the foot that it began with (-1 at the start of a run); and of
// every eight directions the rows of its matrix: the events' numbers, the moment that is shared, since when feet are held, the
// state after it.
struct InstantMap {
  size_t steps = 0;
  int foot = -1;
  std::vector<size_t> events;
  std::vector<std::vector<Row>> blocks;
};

}  // namespace tarsus::modal

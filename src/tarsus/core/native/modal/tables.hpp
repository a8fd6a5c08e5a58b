// Contact modes: the linear structure with some feet held on the ground, and its steps; what runs share and read.
//
// tarsus.core.modes makes a contact mode and says what each of its arrays is; modal/make.hpp makes its steps. The modes of
// the structure are ``stride`` 2 x 2 blocks, those that are missing zero; a state is the first components of all blocks
// and then the second ones. Inputs of a step: film momenta and smooth forces of all feet, drives, the constant 1. What that
// last one does depends on rest gaps and gravity, which are data of a run: tables hold it per unit of each of these sources,
// and nothing in the place of the input itself (see modal/bias.hpp). Feet that know their way along the ground slide there or
// stick: the second input and the second output of such a foot are then those along the ground (see modal/friction.hpp).
#pragma once
#include <algorithm>
#include <atomic>
#include <initializer_list>
#include <map>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "march/batch.hpp"

namespace tarsus::modal {

constexpr int TERMS = 40;   // most Taylor terms kept for landing inside a step
constexpr int BEFORE = N;   // zeros before the Markov parameters of an output
constexpr int MARKOV = BEFORE + TERMS;

// Which constraints are held, of any number of feet: that foot i is on the ground, and m + i that it sticks there.
struct FootSet {
  std::vector<uint64_t> words;

  explicit FootSet(int constraints = 0) : words(constraints / 64 + 1, 0) {}
  bool has(int constraint) const { return words[constraint / 64] >> (constraint % 64) & 1; }
  void toggle(int constraint) { words[constraint / 64] ^= uint64_t(1) << (constraint % 64); }
  void set(int constraint, bool held) {
    if (has(constraint) != held) toggle(constraint);
  }
  bool operator<(const FootSet& other) const { return words < other.words; }
};

struct Sizes {
  int feet, drives, coordinates;  // m, nd, n
  int stride;                     // blocks that a state has room for
  int outputs;                    // rows of nodes a step gives: gaps or pulls, and their rates too where a law takes them
  int ways = 0;                   // feet, where any knows its way along the ground; else 0

  int constraints() const { return feet + ways; }  // that may be held; and outputs that events are functions of
  int inputs() const { return 2 * feet + drives + 1; }
  int last() const { return 2 * feet + drives; }  // the constant 1
  int sources() const { return feet + GRAVITIES; }  // of what it does: rest gaps, gravity
  int state() const { return 2 * stride; }
};

// The parts of a structure that transfer energy: dampers (n, n); directions of the feet (m, n) and of the drives (nd, n); constant
// forces per unit of gravity (n, GRAVITIES).
struct StructureMatrices {
  std::vector<double> damping, normals, loads, weight;
};

// Arrays laid one after the other in one aligned piece of memory, each from a row on.
typedef std::initializer_list<std::pair<double**, size_t>> Layout;

inline void lay_out(std::vector<Row>& memory, Layout parts) {
  size_t rows = 0;
  for (const auto& part : parts) rows += (part.second + N - 1) / N;
  memory.assign(rows, Row(0.0));
  size_t at = 0;
  for (const auto& part : parts) {
    *part.first = reinterpret_cast<double*>(memory.data() + at);
    at += (part.second + N - 1) / N;
  }
}

// A step of one length in one contact mode.
struct StepClass {
  const Sizes& sizes;
  int number;
  double length;          // [s]
  int terms;              // of the Taylor polynomial that lands inside it; 0: it is too long for that
  double* node_state;     // (outputs, stride, 2, 8): outputs at the nodes from the state
  double* node_constant;  // (outputs, inputs, 8): from a constant input
  double* node_input;     // (outputs, inputs, 8 from, 8 to): from nodal inputs
  double* exponential;    // (4, stride): rows e11, e12, e21, e22 of the blocks
  double* state_constant; // (inputs, state): state at the end from a constant input
  double* state_input;    // (inputs, 8, state)
  double* node_bias;      // (sources, outputs, 8): outputs at the nodes per unit of a source
  double* state_bias;     // (sources, state): and the state at the end
  double* envelope;       // (constraints, stride): what an output does beyond its chords per |y'| of a block
  double* reach;          // (2 feet): farthest that a unit smooth input moves its own foot's gap at any node
  double* growth;         // (TERMS): (rate h)^c / c!
  double* share;          // (8): c! / ((rate h)^c rate)
  std::vector<Row> memory;

  StepClass(const Sizes& s, int k, double h, int t) : sizes(s), number(k), length(h), terms(t) {
    const size_t inputs = s.inputs(), outputs = s.outputs, stride = s.stride, state = s.state();
    lay_out(memory, {{&node_state, outputs * state * N}, {&node_constant, outputs * inputs * N},
                     {&node_input, outputs * inputs * N * N}, {&exponential, 4 * stride},
                     {&state_constant, inputs * state}, {&state_input, inputs * N * state},
                     {&node_bias, s.sources() * outputs * N}, {&state_bias, s.sources() * state},
                     {&envelope, s.constraints() * stride}, {&reach, 2 * size_t(s.feet)}, {&growth, TERMS}, {&share, N}});
  }
  StepClass(const StepClass&) = delete;

  TARSUS_INLINE const double* from_state(int output) const { return node_state + output * sizes.state() * N; }
  TARSUS_INLINE Row from_constant(int output, int input) const {
    return load(node_constant + (output * sizes.inputs() + input) * N);
  }
  TARSUS_INLINE const double* from_input(int output, int input) const {
    return node_input + (output * sizes.inputs() + input) * N * N;
  }
};

struct StepMaker;
struct ContactMode;

// The structure with some constraints held; rows are per foot or output, states (2 stride) or inputs wide.
struct ContactMode {
  const Sizes& sizes;
  int number = 0;         // in the order in which contact modes were made
  FootSet feet;
  std::vector<int> held, free;
  std::vector<int> stuck, sliding;  // held feet that stick; and those that know their way along the ground, and do not
  std::vector<int> leading;  // free feet whose gaps determine those of all others; all of them where they are independent
  std::vector<uint8_t> is_held, is_stuck;
  int blocks_used = 0;
  double rate = 0.0;      // [1/s] largest norm of a block
  int landing_class = 0;  // longest step in which an event can be landed on
  std::vector<int> terms; // of every class

  double *blocks, *inputs, *input_norm, *beta, *outputs, *feed, *feed_rate, *to_physical, *from_physical;
  double *held_rows, *held_feed, *jump, *mobility, *reaction, *side, *side_rate, *skew, *level, *amplitude_bound;
  double *printed, *printed_feed, *printed_damping;
  double* spanned;  // (feet, leading): gap of a free foot per unit of those, in addition to its gap at rest
  // per unit of a source, source by source: inputs (state), direct parts of outputs (2 feet), place (2 n), direct parts of
  // the pulls if held and as printed (feet), and outputs (T / rate)^c inputs (constraints, MARKOV)
  double *bias_inputs, *bias_feed, *bias_offset, *bias_held, *bias_printed, *bias_markov;
  // along the ground (see tarsus.core.modes): of feet that stick (feet, coordinates), of the others (feet, state), and
  // (2 feet, feet)
  double *placed, *slide, *slide_rate, *slide_feed;
  double* ladder;  // (constraints, stride, 2, TERMS): outputs (T / rate)^c
  double* markov;  // (constraints, inputs, MARKOV): outputs (T / rate)^c inputs
  double* powers;  // (TERMS, 4, stride): (T / rate)^c
  std::vector<Row> memory;

  mutable std::unique_ptr<std::atomic<const StepClass*>[]> steps;
  mutable std::unique_ptr<std::atomic<const ContactMode*>[]> neighbours;  // the contact mode with one constraint more or less

  ContactMode(const Sizes& s, FootSet on, std::vector<int> lead, int classes)
      : sizes(s), feet(std::move(on)), leading(std::move(lead)), is_held(s.feet), is_stuck(s.feet),
        steps(new std::atomic<const StepClass*>[classes]()), neighbours(new std::atomic<const ContactMode*>[s.constraints() + 1]()),
        classes_(classes) {
    const size_t m = s.feet, ni = s.inputs(), st = s.state(), n2 = 2 * s.coordinates, ns = s.stride, sr = s.sources();
    const size_t ways = s.ways, all = s.constraints();
    lay_out(memory,
            {{&blocks, 4 * ns}, {&inputs, ni * st}, {&input_norm, ni * ns}, {&outputs, 2 * m * st}, {&feed, 2 * m * ni},
             {&beta, m * st}, {&feed_rate, 2 * m * ni}, {&to_physical, n2 * st}, {&from_physical, st * n2},
             {&held_rows, m * st}, {&held_feed, m * ni}, {&jump, m * st}, {&mobility, m}, {&reaction, m * m},
             {&side, m * st}, {&side_rate, m * st}, {&skew, m}, {&level, all * st}, {&amplitude_bound, all * ns}, {&printed, m * st},
             {&printed_feed, m * ni}, {&printed_damping, m}, {&ladder, all * st * TERMS}, {&markov, all * ni * MARKOV},
             {&placed, ways * n2 / 2}, {&slide, ways * st}, {&slide_rate, ways * st}, {&slide_feed, 2 * ways * ways},
             {&powers, TERMS * 4 * ns}, {&bias_inputs, sr * st}, {&bias_feed, sr * 2 * m}, {&bias_offset, sr * n2},
             {&bias_held, sr * m}, {&bias_printed, sr * m}, {&bias_markov, sr * all * MARKOV}, {&spanned, m * leading.size()}});
    for (int i = 0; i < s.feet; i++) {
      is_held[i] = feet.has(i);
      is_stuck[i] = s.ways > 0 && feet.has(s.feet + i);
      (is_held[i] ? held : free).push_back(i);
      if (is_stuck[i]) stuck.push_back(i);
    }
  }
  ContactMode(const ContactMode&) = delete;

  // Change of a free foot's gap rate per unit change of that of ``impacted`` by an impulse there.
  double rate_by_jump(int impacted, int foot) const {
    const double *row = outputs + size_t(sizes.feet + foot) * sizes.state(), *by = jump + size_t(impacted) * sizes.state();
    double sum = 0.0;
    for (int k = 0; k < sizes.state(); k++) sum += row[k] * by[k];
    return sum;
  }

  // Whether gaps of feet are sums of others'.
  bool shares() const { return leading.size() < free.size(); }
  ~ContactMode() {
    for (int k = 0; k < classes_; k++) delete steps[k].load();
  }

 private:
  int classes_;
};

// The contact modes that runs have needed so far; shared by threads. Modes and steps stay where they are until the book goes.
class Book {
 public:
  const Sizes sizes;
  const std::vector<double> lengths;  // [s], halving
  const std::vector<double> tangents; // (ways, coordinates): the place of each foot along the ground
  const StructureMatrices structure;

  Book(const Sizes& s, std::vector<double> h, std::vector<double> t, StructureMatrices c)
      : sizes(s), lengths(std::move(h)), tangents(std::move(t)), structure(std::move(c)) {}
  virtual ~Book() = default;
  Book(const Book&) = delete;

  int classes() const { return int(lengths.size()); }

  // The contact mode with these feet on the ground, made now if no run has needed it before.
  const ContactMode& require(const FootSet& feet) {
    if (const ContactMode* known = find(feet)) return *known;
    return make(feet);
  }

  // The neighbour of a contact mode: a constraint held where it was free, or free where it was held.
  const ContactMode& toggled(const ContactMode& mode, int constraint) {
    if (const ContactMode* known = mode.neighbours[constraint].load(std::memory_order_acquire)) return *known;
    FootSet feet = mode.feet;
    feet.toggle(constraint);
    const ContactMode& found = require(feet);
    mode.neighbours[constraint].store(&found, std::memory_order_release);
    return found;
  }

  // The one in which a foot is held along its normal or not, and along the ground or not.
  const ContactMode& with_foot(const ContactMode& mode, int foot, bool held, bool stuck) {
    const bool turns = mode.is_held[foot] != held, sticks = mode.is_stuck[foot] != stuck;
    if (!turns || !sticks) return turns ? toggled(mode, foot) : sticks ? toggled(mode, sizes.feet + foot) : mode;
    FootSet feet = mode.feet;
    feet.set(foot, held);
    feet.set(sizes.feet + foot, stuck);
    return require(feet);
  }

  // Place along the ground of a foot [m], of displacements.
  double place_along(int foot, const std::vector<double>& physical) const {
    double sum = 0.0;
    for (int r = 0; r < sizes.coordinates; r++) sum = sum + physical[r] * tangents[size_t(foot) * sizes.coordinates + r];
    return sum;
  }

  // Whether a foot knows its way along the ground.
  bool has_way(int foot) const {
    const auto row = tangents.begin() + (sizes.ways > 0 ? size_t(foot) * sizes.coordinates : 0);
    return sizes.ways > 0 && std::any_of(row, row + sizes.coordinates, [](double x) { return x != 0.0; });
  }

  TARSUS_INLINE const StepClass& step(const ContactMode& mode, int k) {
    const StepClass* known = mode.steps[k].load(std::memory_order_acquire);
    return __builtin_expect(known != nullptr, 1) ? *known : make_step(mode, k);
  }

  // The contact mode of that number, which has been made.
  const ContactMode& numbered(int q) {
    std::lock_guard<std::mutex> lock(mutex_);
    return *modes_.at(q);
  }

 protected:
  const ContactMode* find(const FootSet& feet) {
    std::lock_guard<std::mutex> lock(mutex_);
    const auto found = numbers_.find(feet);
    return found == numbers_.end() ? nullptr : modes_[found->second].get();
  }

  // Keep a contact mode, unless another thread was first.
  const ContactMode& keep(std::unique_ptr<ContactMode> mode) {
    std::lock_guard<std::mutex> lock(mutex_);
    const auto [place, fresh] = numbers_.emplace(mode->feet, int(modes_.size()));
    if (fresh) {
      mode->number = int(modes_.size());
      modes_.push_back(std::move(mode));
    }
    return *modes_[place->second];
  }

  virtual const ContactMode& make(const FootSet& feet) = 0;
  virtual std::unique_ptr<StepClass> new_step(const ContactMode& mode, int k) = 0;

 private:
  std::mutex mutex_;
  std::map<FootSet, int> numbers_;
  std::vector<std::unique_ptr<ContactMode>> modes_;

  // Made outside of any lock; where two threads make the same, the first stays.
  TARSUS_APART const StepClass& make_step(const ContactMode& mode, int k) {
    std::unique_ptr<StepClass> made = new_step(mode, k);
    const StepClass* none = nullptr;
    if (mode.steps[k].compare_exchange_strong(none, made.get(), std::memory_order_acq_rel)) return *made.release();
    return *none;
  }
};

}  // namespace tarsus::modal

// The energies of steps: the work of drives and weight, of dampers, of resistive and smooth laws, law by law.
//
// Within a step the motion is linear in its vector z: the state at its start and the Legendre coefficients of its inputs. The
// energy that a force transfers over a whole step is therefore a form z^T G l, where l is the part of z that transfers it:
// z itself for the dampers, the coefficients of the forces for those that do work. G is made by Gauss quadrature for a step that
// resolves the fastest mode, and by doubling from there, for a step is two steps of half its length: a step costs the same however
// many oscillations it spans. One that ended early is halved down to where it ended. Nothing is interpolated.
#pragma once
#include <array>
#include <map>

#include "modal/accepted.hpp"
#include "modal/make.hpp"

namespace tarsus::modal {

// Values of the first N Legendre polynomials on [0, 1] at s, and their derivatives by s.
template <class Real>
inline void legendre_at(const Real& s, Real* value, Real* slope) {
  const Real x = s * 2.0 - 1.0;
  value[0] = Real(1.0);
  value[1] = x;
  slope[0] = Real(0.0);
  slope[1] = Real(2.0);
  for (int l = 2; l < N; l++) {
    value[l] = x * value[l - 1] * ((2.0 * l - 1.0) / l) - value[l - 2] * ((l - 1.0) / l);
    slope[l] = slope[l - 2] + value[l - 1] * (2.0 * (2 * l - 1));
  }
}

// Constant matrices of Legendre coefficients: an input that hardly changes is one of them, free of rounding.
struct Legendre {
  double of_node[N][N];            // [node][degree]: coefficients of the polynomial that is 1 at one node
  double at_node[N][N];            // [degree][node]
  double half[2][N][N];            // [left, right][degree on the step][degree on the half], and transposed
  double back[2][N][N];
  double power[N][N];              // [degree][c]: coefficient of s^c
  Row at, weight;               // Gauss points on [0, 1]: of what resolves every mode they leave 1e-16

  explicit Legendre(const Nodes& nodes) {
    double unused[N], value[N], on_half[2][N];
    for (int j = 0; j < N; j++) {
      legendre_at(nodes.tau[j], value, unused);
      const double lobatto = 1.0 / (N * (N - 1) * value[N - 1] * value[N - 1]);  // the node's weight on [0, 1]
      for (int l = 0; l < N; l++) {
        at_node[l][j] = value[l];
        // the square of the highest polynomial is beyond what these nodes integrate exactly: they make 1 / (N - 1) of it
        of_node[j][l] = (l < N - 1 ? 2.0 * l + 1.0 : N - 1.0) * lobatto * value[l];
      }
    }
    std::fill(&half[0][0][0], &half[0][0][0] + 2 * N * N, 0.0);
    for (int g = 0; g < N; g++) {
      set_point(g);
      legendre_at(at[g], value, unused);
      legendre_at(0.5 * at[g], on_half[0], unused);
      legendre_at(0.5 * at[g] + 0.5, on_half[1], unused);
      for (int side : {0, 1}) {
        for (int l = 0; l < N; l++) {
          for (int k = 0; k <= l; k++) half[side][l][k] += (2 * k + 1) * weight[g] * on_half[side][l] * value[k];
        }
      }
    }
    for (int side : {0, 1}) {
      for (int l = 0; l < N; l++) {
        for (int k = 0; k < N; k++) back[side][k][l] = half[side][l][k];
      }
    }
    for (int l = 0; l < N; l++) {
      double factor = l % 2 ? -1.0 : 1.0;  // (-1)^(l + c) (l over c) (l + c over c)
      for (int c = 0; c < N; c++) {
        power[l][c] = c <= l ? factor : 0.0;
        factor *= -double((l - c) * (l + c + 1)) / ((c + 1) * (c + 1));
      }
    }
  }

 private:
  // A zero of the polynomial of degree N, by Newton's method from Chebyshev's, and its weight.
  void set_point(int g) {
    double s = 0.5 - 0.5 * std::cos(std::acos(-1.0) * (g + 0.75) / (N + 0.5)), value[N], slope[N], next = 0.0, rise = 0.0;
    for (int n = 0; n < 6; n++) {
      legendre_at(s, value, slope);
      next = ((2 * N - 1) * (2.0 * s - 1.0) * value[N - 1] - (N - 1) * value[N - 2]) / N;
      rise = slope[N - 2] + 2.0 * (2 * N - 1) * value[N - 1];
      s -= next / rise;
    }
    at.set(g, s);
    weight.set(g, 1.0 / (s * (1.0 - s) * rise * rise));
  }
};

// Columns of z that transfer one kind of energy, and the first row of 8 in which they lie in l.
struct Part {
  int first = 0, count = 0, row = 0;
  int rows() const { return (count + N - 1) / N; }
};

// Of all laws of a kind, in the order of `tarsus.core.arrays`; places where feet stick move the structure, and do no work.
enum Energy { WORK, DAMPING, RESISTIVE, SMOOTH, FRICTION_WORK, ENERGIES, PLACES = ENERGIES, KINDS };

// An input of a step: its number, the kind of energy it transfers, the first of its columns and their number: 8, or 1 where it is
// constant in every step.
struct Input {
  int number, energy, first, count;
};

typedef std::vector<std::vector<double>> Shares;  // coefficients, in one step, of each of the laws that act at once

// The vectors of the steps of one contact mode, and the forms of their energies.
//
// Columns of z: the state (2 blocks); momenta and smooth forces of the feet that lead (see ContactMode::leading); friction on feet
// that slide, places of those that stick; drives; the constant input. The state is counted from the place at which the mean forces
// would hold it at rest, where its velocity is exactly zero: computed from the whole state of a stiff mode, that velocity would
// be a small difference of large numbers.
class ModeEnergies {
 public:
  typedef std::vector<Row> Form;  // (width, rows): G, or a map of vectors, with the image of each column

  // count: columns of each input, by its number, 0 where it is zero in every step; of feet, of those that lead.
  ModeEnergies(Book& book, const ContactMode& mode, const Legendre& legendre, const double* sources, const std::vector<int>& count)
      : book_(book), mode_(mode), by_(book.structure), legendre_(legendre), blocks_(mode.blocks_used), state_(2 * mode.blocks_used),
        coordinates_(mode.sizes.coordinates), width_(state_) {
    for (int b = 0; b < blocks_; b++) rate_ = std::max(rate_, norm_of(block_of(mode, b)));
    const int m = mode.sizes.feet;
    for (int kind : {RESISTIVE, SMOOTH}) {
      for (int i : mode.shares() ? mode.leading : mode.free) add_input(kind, kind == SMOOTH ? m + i : i, count);
    }
    for (int i : mode.sliding) add_input(FRICTION_WORK, m + i, count);
    for (int i : mode.stuck) add_input(PLACES, m + i, count);
    for (int i = 2 * m; i < mode.sizes.inputs(); i++) add_input(WORK, i, count);
    if (std::any_of(by_.damping.begin(), by_.damping.end(), [](double c) { return c != 0.0; })) parts_[DAMPING].count = width_;
    for (Part& part : parts_) {
      part.row = rows_;
      rows_ += part.rows();
    }
    rows_ += (AT_ONCE - rows_ % AT_ONCE) % AT_ONCE;
    copy_mode(sources);
    for (int r = 0; r < coordinates_; r++) constant_.push_back(by_.weight[2 * r] * sources[m] + by_.weight[2 * r + 1] * sources[m + 1]);
    find_equilibria();
    one_.assign(room(), 0.0);
    done_.assign(std::max(rows_, wide()), Row(0.0));
    first_.assign(room(), 0.0);
    series_.assign(size_t(SERIES + 1) * state_, 0.0);
    flowing_.assign(state_, Row(0.0));
  }

  int room() const { return width_ + N; }  // of z, any part of which may be read in rows of 8

  // The vector of a step.
  void fill(const AcceptedStep& step, double* z) const {
    const int m = mode_.sizes.feet;
    for (int half : {0, 1}) std::copy_n(step.state.data() + half * mode_.sizes.stride, blocks_, z + half * blocks_);
    std::fill(z + state_, z + room(), 0.0);
    if (parts_[RESISTIVE].count) add_coefficients(step.inputs.data(), true, z + parts_[RESISTIVE].first);
    if (parts_[SMOOTH].count) add_coefficients(step.inputs.data() + m, false, z + parts_[SMOOTH].first);
    for (const Input& input : inputs_) {
      if (input.energy == RESISTIVE || input.energy == SMOOTH) continue;
      const Row& nodal = step.inputs[input.number];
      z[input.first] = nodal[0];
      if (input.count == N) store(z + input.first, coefficients(nodal, false));
    }
    for (const Equilibrium& rest : equilibria_) {
      for (int k = 0; k < state_; k++) z[k] -= z[rest.column] * rest.place[k];
    }
  }

  // Add the coefficients (leading, 8) of the inputs at the feet, given at the nodes (feet, 8). Where many feet move few modes, the
  // leading feet get inputs that move the structure, and do work on it, as those of all feet do.
  void add_coefficients(const Row* nodal, bool momenta, double* to) const {
    const int lead = int(mode_.leading.size());
    for (size_t f = 0; f < mode_.free.size(); f++) {
      const Row own = coefficients(nodal[mode_.free[f]], momenta);
      if (!mode_.shares()) {
        store(to + N * f, load(to + N * f) + own);
        continue;
      }
      for (int l = 0; l < lead; l++) store(to + N * l, load(to + N * l) + own * mode_.spanned[mode_.free[f] * lead + l]);
    }
  }

  // Add the energies of a step of class k up to its scaled time ``along`` to ``out`` (ENERGIES), and the work of laws that have a
  // share of it behind: each share by its coefficients, of resistive laws first. z and the shares become those of what is left.
  void add(int k, double along, double* z, Shares& shares, int resistive, double* out) {
    if (along == 1.0) return add_whole(k, z, shares, resistive, out);
    while (along * book_.lengths[k] * rate_ > RESOLVED && k + 1 < book_.classes()) {
      const std::array<Form, 2>& halves = this->halves(++k);
      const bool late = along >= 0.5;
      if (late) {
        std::copy(z, z + room(), first_.begin());
        first_shares_ = shares;
        to_half(halves, 0, first_.data(), first_shares_);
        add_whole(k, first_.data(), first_shares_, resistive, out);
      }
      to_half(halves, late, z, shares);
      along = 2.0 * along - late;
    }
    Motion& motion = last_;
    take_motion(z, book_.lengths[k], along, motion);
    for (int e : {WORK, RESISTIVE, SMOOTH, FRICTION_WORK}) out[e] += work_over(motion, e, z + parts_[e].first);
    if (parts_[DAMPING].count) {
      find_damping_forces(motion.velocity, damped_);
      out[DAMPING] += energy_of(motion, damped_);
    }
    for (size_t s = 0; s < shares.size(); s++) {
      out[ENERGIES + s] += work_over(motion, int(s) < resistive ? RESISTIVE : SMOOTH, shares[s].data());
    }
  }

 private:
  static constexpr int AT_ONCE = 4;  // rows of z G: as many sums as keep a machine busy
  static constexpr double RESOLVED = 1.0;  // |T| h up to which Taylor polynomials and Gauss points resolve every mode
  // Least determinant of a block, relative to the sum of its squared entries, for which it has a place of rest.
  static constexpr double STEADY = 1e-8;
  static constexpr double NO_TERM = 1e-17;  // size of a Taylor term, relative to the sum, that no longer changes the last digit

  // For a column that is the mean of an input: the place at which it holds the blocks that have a place of rest; the velocities
  // that it causes by the other blocks alone; and its push on those other blocks (state).
  struct Equilibrium {
    int column;
    std::vector<double> place, drift, push;
  };

  // Over part of a step, at its Gauss points: velocities (coordinates); Legendre polynomials of the step, and their derivatives
  // by time.
  struct Motion {
    std::vector<Row> velocity;
    Row value[N], slope[N];
    double span;
  };

  Book& book_;
  const ContactMode& mode_;
  const StructureMatrices& by_;
  const Legendre& legendre_;
  const int blocks_, state_, coordinates_;
  int width_, rows_ = 0;  // of z, and rows of l
  double rate_ = 0.0;
  Part parts_[KINDS];
  std::vector<Input> inputs_;
  std::vector<Equilibrium> equilibria_;
  std::vector<double> beta_, velocity_, pushes_, filmed_;  // (feet, state), (coordinates, state), (inputs, state), (feet, coordinates)
  std::vector<double> sources_, constant_;  // and constant forces (coordinates)
  std::vector<uint8_t> balanced_;  // blocks that have a place of rest
  std::map<int, Form> forms_;
  std::map<int, std::array<Form, 2>> halves_;
  // room to work in: unit vectors, the first half of a step, Taylor series, z G, motion and dampers' forces
  std::vector<double> one_, first_, series_;
  std::vector<Row> done_;
  Shares first_shares_;
  std::vector<Row> flowing_, damped_;
  Motion last_;

  void add_input(int energy, int number, const std::vector<int>& count) {
    const int columns = energy == PLACES ? 1 : energy == FRICTION_WORK ? N : count[number];
    Part& part = parts_[energy];
    if (part.count == 0) part.first = width_;
    if (columns) inputs_.push_back({number, energy, width_, columns});
    part.count += columns;
    width_ += columns;
  }

  // Rows of the contact mode without the room that states have, and the constant input as these sources make it.
  void copy_mode(const double* sources) {
    const Sizes& s = mode_.sizes;
    const auto compact = [&](const double* from, int rows) {
      std::vector<double> out;
      for (int r = 0; r < 2 * rows; r++) out.insert(out.end(), from + r * s.stride, from + r * s.stride + blocks_);
      return out;
    };
    beta_ = compact(mode_.beta, s.feet);
    velocity_ = compact(mode_.to_physical + size_t(coordinates_) * s.state(), coordinates_);
    pushes_ = compact(mode_.inputs, s.inputs());
    const std::vector<double> bias = compact(mode_.bias_inputs, s.sources());
    for (int k = 0; k < state_; k++) {
      double& push = pushes_[size_t(s.last()) * state_ + k];
      push = 0.0;
      for (int q = 0; q < s.sources(); q++) push += sources[q] * bias[q * state_ + k];
    }
    filmed_.assign(size_t(s.feet) * coordinates_, 0.0);
    for (int i = 0; i < s.feet; i++) {
      for (int r = 0; r < coordinates_; r++) {
        for (int k = 0; k < state_; k++) filmed_[i * coordinates_ + r] += velocity_[r * state_ + k] * beta_[i * state_ + k];
      }
    }
    sources_.assign(sources, sources + s.sources());
  }
  void find_equilibria() {
    const int m = mode_.sizes.feet;
    for (int b = 0; b < blocks_; b++) {
      const Matrix2 block = block_of(mode_, b);
      const auto& t = block.a;
      const double squares = t[0][0] * t[0][0] + t[0][1] * t[0][1] + t[1][0] * t[1][0] + t[1][1] * t[1][1];
      balanced_.push_back(std::fabs(t[0][0] * t[1][1] - t[0][1] * t[1][0]) > STEADY * squares);
    }
    for (const Input& input : inputs_) {
      if (input.number < m) continue;  // a momentum pushes by its rate of change
      Equilibrium rest{input.first, std::vector<double>(state_, 0.0), std::vector<double>(coordinates_, 0.0), {}};
      const double* push = pushes_.data() + size_t(input.number) * state_;
      rest.push.assign(push, push + state_);
      for (int b = 0; b < blocks_; b++) {
        if (!balanced_[b]) continue;
        const Matrix2 block = block_of(mode_, b);
        const auto& t = block.a;
        const double det = t[0][0] * t[1][1] - t[0][1] * t[1][0];
        rest.place[b] = (t[0][1] * push[blocks_ + b] - t[1][1] * push[b]) / det;
        rest.place[blocks_ + b] = (t[1][0] * push[b] - t[0][0] * push[blocks_ + b]) / det;
        rest.push[b] = rest.push[blocks_ + b] = 0.0;
      }
      const double* places = mode_.to_physical;
      for (int r = 0; r < coordinates_; r++) {
        for (int b = 0; b < blocks_; b++) {
          const double* row = places + size_t(r) * mode_.sizes.state();
          rest.drift[r] += row[b] * rest.push[b] + row[mode_.sizes.stride + b] * rest.push[blocks_ + b];
        }
      }
      equilibria_.push_back(std::move(rest));
    }
  }

  Row coefficients(const Row& nodal, bool momenta) const {
    Row out = combine(&legendre_.of_node[0][0], nodal - nodal[0]);
    if (!momenta) out.set(0, out[0] + nodal[0]);
    return out;
  }

  // ---- halves of steps

  int wide() const { return (width_ + N - 1) / N; }  // rows of a map
  // Where a column of a map lies.
  double* entry(Form& map, int from, int to) const { return reinterpret_cast<double*>(map.data() + size_t(from) * wide()) + to; }

  // The maps of a step to its halves, which are of class k.
  const std::array<Form, 2>& halves(int k) {
    const auto known = halves_.find(k);
    if (known != halves_.end()) return known->second;
    const StepClass& step = book_.step(mode_, k);
    const int ns = mode_.sizes.stride;
    const double* e = step.exponential;
    std::array<Form, 2> out = {Form(size_t(width_) * wide(), Row(0.0)), Form(size_t(width_) * wide(), Row(0.0))};
    for (int r = 0; r < state_; r++) *entry(out[0], r, r) = 1.0;
    for (int b = 0; b < blocks_; b++) {
      for (int c = 0; c < 4; c++) *entry(out[1], c % 2 * blocks_ + b, c / 2 * blocks_ + b) = e[c * ns + b];
    }
    std::vector<double> response(size_t(N) * state_);
    for (const Input& input : inputs_) {
      const auto rest = std::find_if(equilibria_.begin(), equilibria_.end(), [&](const Equilibrium& one) { return one.column == input.first; });
      respond(step, input, response);
      for (int r = 0; rest != equilibria_.end() && r < state_; r++) {  // blocks that a mean holds at rest do not move by it
        if (balanced_[r % blocks_]) response[r] = 0.0;
      }
      for (int l = 0; l < input.count; l++) {
        double *left = entry(out[0], input.first + l, 0), *right = entry(out[1], input.first + l, 0);
        for (int r = 0; rest != equilibria_.end() && l > 0 && r < state_; r++) {  // the mean over a half is another one
          left[r] = -legendre_.half[0][l][0] * rest->place[r];
          right[r] = (legendre_.half[0][l][0] - legendre_.half[1][l][0]) * rest->place[r];
        }
        for (int b = 0; b < blocks_; b++) {
          right[b] += e[b] * left[b] + e[ns + b] * left[blocks_ + b];
          right[blocks_ + b] += e[2 * ns + b] * left[b] + e[3 * ns + b] * left[blocks_ + b];
        }
        for (int c = 0; c <= l; c++) {
          for (int r = 0; r < state_; r++) right[r] += legendre_.half[0][l][c] * response[size_t(c) * state_ + r];
          left[input.first + c] = legendre_.half[0][l][c];
          right[input.first + c] = legendre_.half[1][l][c];
        }
      }
    }
    return halves_.emplace(k, std::move(out)).first->second;
  }

  // State at the end of a step under each Legendre polynomial of an input (8, state).
  void respond(const StepClass& step, const Input& input, std::vector<double>& out) const {
    const Sizes& s = mode_.sizes;
    std::fill(out.begin(), out.end(), 0.0);
    for (int r = 0; r < state_; r++) {
      const int at = r / blocks_ * s.stride + r % blocks_;
      if (input.number == s.last()) {
        for (int q = 0; q < s.sources(); q++) out[r] += sources_[q] * step.state_bias[q * s.state() + at];
        continue;
      }
      for (int l = 0; l < input.count; l++) {
        for (int j = 0; j < N; j++) {
          out[size_t(l) * state_ + r] += legendre_.at_node[l][j] * step.state_input[(size_t(input.number) * N + j) * s.state() + at];
        }
      }
    }
  }

  // Multiply an input by one of the matrices of Legendre, in place; a constant one is unchanged.
  static void transform(const double* matrix, int count, double* x) {
    if (count == N) store(x, combine(matrix, load(x)));
  }

  // Turn z and the shares of a step into those of one of its halves.
  void to_half(const std::array<Form, 2>& maps, int side, double* z, Shares& shares) {
    std::fill(done_.begin(), done_.begin() + wide(), Row(0.0));
    const Row* map = maps[side].data();
    for (int b = 0; b < width_; b++, map += wide()) {
      for (int r = 0; r < wide(); r++) done_[r] += map[r] * z[b];
    }
    for (int r = 0; r < wide(); r++) store(z + N * r, done_[r]);
    for (std::vector<double>& share : shares) {
      for (size_t first = 0; first < share.size(); first += N) transform(legendre_.half[side][0], N, share.data() + first);
    }
  }

  // ---- forms

  void add_whole(int k, const double* z, const Shares& shares, int resistive, double* out) {
    apply(form(k), z);
    for (int e = 0; e < ENERGIES; e++) out[e] += product(parts_[e], z + parts_[e].first);
    for (size_t s = 0; s < shares.size(); s++) out[ENERGIES + s] += product(parts_[int(s) < resistive ? RESISTIVE : SMOOTH], shares[s].data());
  }

  // The form of a step of class k, made from that of the next shorter one that is there.
  const Form& form(int k) {
    auto from = forms_.lower_bound(k);
    if (from == forms_.end()) {
      int bottom = k;
      while (bottom + 1 < book_.classes() && book_.lengths[bottom] * rate_ > RESOLVED) bottom++;
      from = forms_.emplace(bottom, quadrature(bottom)).first;
    }
    for (int c = from->first; c > k; c--) from = forms_.emplace(c - 1, doubled(from->second, halves(c))).first;
    return from->second;
  }

  // z G.
  void apply(const Form& form, const double* z) {
    for (int row = 0; row < rows_; row += AT_ONCE) {
      Row sum[AT_ONCE];
      std::fill(sum, sum + AT_ONCE, Row(0.0));
      const Row* g = form.data() + row;
      for (int b = 0; b < width_; b++, g += rows_) {
        for (int r = 0; r < AT_ONCE; r++) sum[r] += g[r] * z[b];
      }
      std::copy(sum, sum + AT_ONCE, done_.data() + row);
    }
  }
  // ``by``: (count), and readable up to the next row of 8.
  double product(const Part& part, const double* by) const {
    Row sum = Row(0.0);
    for (int r = 0; r < part.rows(); r++) sum += done_[part.row + r] * load(by + N * r);
    return total(sum);
  }

  // G of a step from that of its halves: M G N for each, with the maps M of z and N of l. Of the dampers N is M transposed: their form
  // is turned over between, and so comes out turned over, which is the same energy.
  Form doubled(const Form& half, const std::array<Form, 2>& maps) const {
    Form out(half.size(), Row(0.0));
    for (int side : {0, 1}) {
      Form once = multiplied(maps[side], half);
      for (int b = 0; b < parts_[DAMPING].count; b++) {
        for (int a = 0; a < b; a++) {
          std::swap(*place(once.data() + size_t(a) * rows_, DAMPING, b), *place(once.data() + size_t(b) * rows_, DAMPING, a));
        }
      }
      const Form twice = multiplied(maps[side], once);
      for (int b = 0; b < width_; b++) {
        Row* row = once.data() + size_t(b) * rows_;
        std::copy_n(twice.data() + size_t(b) * rows_ + parts_[DAMPING].row, parts_[DAMPING].rows(), row + parts_[DAMPING].row);
        for (const Input& input : inputs_) transform(legendre_.back[side][0], input.count, place(row, input.energy, input.first));
        for (int r = 0; r < rows_; r++) out[size_t(b) * rows_ + r] += row[r];
      }
    }
    return out;
  }

  // A map times a form: most of a map is zero.
  Form multiplied(const Form& map, const Form& form) const {
    Form out(form.size(), Row(0.0));
    for (int from = 0; from < width_; from++) {
      const double* factors = reinterpret_cast<const double*>(map.data() + size_t(from) * wide());
      for (int to = 0; to < width_; to++) {
        for (int r = 0; r < rows_ && factors[to] != 0.0; r++) out[size_t(from) * rows_ + r] += form[size_t(to) * rows_ + r] * factors[to];
      }
    }
    return out;
  }

  // Where a column of z lies in a row of G.
  double* place(Row* row, int energy, int column) const {
    return reinterpret_cast<double*>(row + parts_[energy].row) + column - parts_[energy].first;
  }

  // ---- Gauss quadrature of what resolves every mode

  // Take the motion over the scaled times [0, along] of a step.
  void take_motion(const double* z, double length, double along, Motion& out) {
    out.span = along * length;
    legendre_at(legendre_.at * along, out.value, out.slope);
    for (Row& slope : out.slope) slope *= 1.0 / length;
    const int terms = fill_series(z, out.span, along);
    std::fill(flowing_.begin(), flowing_.end(), Row(0.0));
    for (int c = terms; c >= 0; c--) {  // independent sums, which the machine works on at the same time
      for (int k = 0; k < state_; k++) flowing_[k] = flowing_[k] * legendre_.at + series_[size_t(c) * state_ + k];
    }
    out.velocity.assign(coordinates_, Row(0.0));
    for (const Equilibrium& rest : equilibria_) {
      for (int r = 0; r < coordinates_; r++) out.velocity[r] += z[rest.column] * rest.drift[r];
    }
    for (int k = 0; k < state_; k++) {
      for (int r = 0; r < coordinates_; r++) out.velocity[r] += flowing_[k] * velocity_[r * state_ + k];
    }
    for (const Input& input : inputs_) {
      if (input.energy != RESISTIVE) break;  // momenta come first
      const Row momentum = sum_of(out.value, z + input.first, N);
      for (int r = 0; r < coordinates_; r++) out.velocity[r] += momentum * filmed_[input.number * coordinates_ + r];
    }
  }

  static Row sum_of(const Row* polynomials, const double* coefficients, int count) {
    Row out = polynomials[0] * coefficients[0];
    for (int l = 1; l < count; l++) out += polynomials[l] * coefficients[l];
    return out;
  }

  // Taylor coefficients (., state) of the flowing state over [0, along] of a step, scaled to [0, 1]; returns their number less one.
  int fill_series(const double* z, double span, double along) {
    const double* t = mode_.blocks;
    const int ns = mode_.sizes.stride;
    std::copy(z, z + state_, series_.begin());
    double power = 1.0, size = 1.0;
    int c = 0;
    for (; c < SERIES && (c <= N || size > NO_TERM); c++, power *= along) {
      size *= span * rate_ / (c + 1);
      const double* term = series_.data() + size_t(c) * state_;
      double* next = series_.data() + size_t(c + 1) * state_;
      for (int b = 0; b < blocks_; b++) {
        next[b] = t[b] * term[b] + t[ns + b] * term[blocks_ + b];
        next[blocks_ + b] = t[2 * ns + b] * term[b] + t[3 * ns + b] * term[blocks_ + b];
      }
      for (const Input& input : inputs_) {
        double by = 0.0;
        const bool mean = c == 0 && input.energy != RESISTIVE;  // of it, see Equilibrium
        for (int l = mean ? 1 : c; l < input.count; l++) by += z[input.first + l] * legendre_.power[l][c];
        if (by == 0.0) continue;
        const double* push = pushes_.data() + size_t(input.number) * state_;
        for (int k = 0; k < state_; k++) next[k] += power * by * push[k];
      }
      for (const Equilibrium& rest : equilibria_) {
        for (int k = 0; c == 0 && k < state_; k++) next[k] += z[rest.column] * rest.push[k];
      }
      for (int k = 0; k < state_; k++) next[k] *= span / (c + 1);
    }
    return c;
  }

  // Forces of the dampers under these velocities.
  void find_damping_forces(const std::vector<Row>& velocity, std::vector<Row>& out) const {
    out.assign(coordinates_, Row(0.0));
    for (int c = 0; c < coordinates_; c++) {
      for (int r = 0; r < coordinates_; r++) out[r] += velocity[c] * by_.damping[size_t(r) * coordinates_ + c];
    }
  }

  double integral(const Motion& motion, const Row& power) const { return total(power * legendre_.weight) * motion.span; }

  // Of the power of some forces along the coordinates, over a motion.
  double energy_of(const Motion& motion, const std::vector<Row>& forces) const {
    Row sum = Row(0.0);
    for (int r = 0; r < coordinates_; r++) sum += forces[r] * motion.velocity[r];
    return integral(motion, sum);
  }

  // Rate at which the structure moves where an input acts.
  Row rate_of(const Motion& motion, const Input& input) const {
    const int m = mode_.sizes.feet;
    Row out = Row(0.0);
    if (input.energy == PLACES) return out;
    const double* along = input.number == mode_.sizes.last() ? constant_.data()
                          : input.energy == WORK ? by_.loads.data() + size_t(input.number - 2 * m) * coordinates_
                          : input.energy == FRICTION_WORK ? book_.tangents.data() + size_t(input.number - m) * coordinates_
                                                          : by_.normals.data() + size_t(input.number % m) * coordinates_;
    for (int r = 0; r < coordinates_; r++) out += motion.velocity[r] * along[r];
    return out;
  }

  // Work of forces with these coefficients, of the columns of one kind.
  double work_over(const Motion& motion, int energy, const double* by) const {
    Row sum = Row(0.0);
    for (const Input& input : inputs_) {
      if (input.energy != energy) continue;
      const double* own = by + input.first - parts_[energy].first;
      sum += sum_of(energy == RESISTIVE ? motion.slope : motion.value, own, input.count) * rate_of(motion, input);
    }
    return integral(motion, sum);
  }

  // G of a step that resolves every mode.
  Form quadrature(int k) {
    Form out(size_t(width_) * rows_, Row(0.0));
    std::vector<Motion> motions(width_);
    for (int b = 0; b < width_; b++) {
      one_[b] = 1.0;
      take_motion(one_.data(), book_.lengths[k], 1.0, motions[b]);
      one_[b] = 0.0;
    }
    for (int b = 0; b < width_; b++) {
      Row* row = out.data() + size_t(b) * rows_;
      if (parts_[DAMPING].count) {
        find_damping_forces(motions[b].velocity, damped_);
        for (int a = 0; a < width_; a++) *place(row, DAMPING, a) = energy_of(motions[a], damped_);
      }
      for (const Input& input : inputs_) {
        const Row rate = rate_of(motions[b], input), *force = input.energy == RESISTIVE ? motions[b].slope : motions[b].value;
        for (int l = 0; l < input.count; l++) *place(row, input.energy, input.first + l) = integral(motions[b], force[l] * rate);
      }
    }
    return out;
  }
};

}  // namespace tarsus::modal

// Contact modes from named arrays, as tarsus.core.modes makes them, and the sizes of their book.
#pragma once
#include <utility>

#include "base/fields.hpp"
#include "modal/tables.hpp"

namespace tarsus::modal {

// How many blocks a state of that many modes has room for.
inline int stride_of(int modes) {
  return modes <= 4 ? 4 : (modes + 7) / 8 * 8;
}

// feet, drives, coordinates; rates: whether a law takes gap rates; tangents (feet, coordinates), or (0,) where no foot knows its way
// along the ground.
inline Sizes sizes_of(const Fields& from) {
  const int feet = int(from.whole("feet")), coordinates = int(from.whole("coordinates"));
  const size_t tangents = from.doubles("tangents").size();
  Fields::check("tangents", tangents == 0 || tangents == size_t(feet) * coordinates);
  const int ways = tangents > 0 ? feet : 0;
  return {feet, int(from.whole("drives")), coordinates, stride_of(coordinates), from.whole("rates") != 0 || ways > 0 ? 2 * feet : feet, ways};
}

inline StructureMatrices structure_of(const Fields& from, const Sizes& s) {
  const size_t n = size_t(s.coordinates);
  return {from.sized("damping", n * n), from.sized("normals", s.feet * n), from.sized("loads", s.drives * n), from.sized("weight", n * GRAVITIES)};
}

// Rows of states (2 blocks) spread to the room (2 stride) that states have.
inline void spread(double* to, const Fields& from, const char* name, int blocks, int stride, size_t rows) {
  const std::vector<double> given = from.sized(name, rows * 2 * blocks);
  for (size_t row = 0; row < rows; row++) {
    for (int half = 0; half < 2; half++) {
      std::copy_n(given.data() + (2 * row + half) * blocks, blocks, to + (2 * row + half) * stride);
    }
  }
}

inline std::unique_ptr<ContactMode> contact_mode_of(const Fields& from, const Book& book, const FootSet& feet, int classes) {
  const Sizes& sizes = book.sizes;
  auto mode = std::make_unique<ContactMode>(sizes, feet, from.narrowed<int>("leading"), classes);
  ContactMode& m = *mode;
  const std::vector<double> blocks = from.doubles("blocks");
  const int nb = int(blocks.size() / 4), ns = sizes.stride, n2 = 2 * sizes.coordinates;
  Fields::check("blocks", blocks.size() % 4 == 0 && nb <= ns);
  m.blocks_used = nb;
  for (int i : m.held) {
    if (!m.is_stuck[i] && book.has_way(i)) m.sliding.push_back(i);
  }
  for (int k = 0; k < 4 * nb; k++) m.blocks[k % 4 * ns + k / 4] = blocks[k];
  const std::vector<double> back = from.sized("from_physical", size_t(2 * nb) * n2);
  for (int half = 0; half < 2; half++) std::copy_n(back.data() + half * nb * n2, nb * n2, m.from_physical + half * ns * n2);
  const size_t feet_count = sizes.feet, ways = sizes.ways, ni = sizes.inputs(), sources = sizes.sources();
  const std::tuple<double*, const char*, size_t> states[] = {
      {m.inputs, "inputs", ni}, {m.outputs, "outputs", 2 * feet_count}, {m.beta, "beta", feet_count},
      {m.to_physical, "to_physical", size_t(n2)}, {m.held_rows, "held", feet_count}, {m.jump, "jump", feet_count},
      {m.side, "side", feet_count}, {m.side_rate, "side_rate", feet_count}, {m.printed, "printed", feet_count},
      {m.slide, "slide", ways}, {m.slide_rate, "slide_rate", ways}, {m.bias_inputs, "bias.inputs", sources}};
  for (const auto& [to, name, rows] : states) spread(to, from, name, nb, ns, rows);
  const std::tuple<double*, const char*, size_t> plain[] = {
      {m.feed, "feed", 2 * feet_count * ni}, {m.feed_rate, "feed_rate", 2 * feet_count * ni}, {m.held_feed, "held_feed", feet_count * ni},
      {m.mobility, "mobility", feet_count}, {m.reaction, "reaction", feet_count * feet_count}, {m.skew, "skew", feet_count},
      {m.printed_feed, "printed_feed", feet_count * ni}, {m.printed_damping, "printed_damping", feet_count},
      {m.spanned, "spanned", feet_count * m.leading.size()}, {m.placed, "placed", ways * n2 / 2},
      {m.slide_feed, "slide_feed", 2 * ways * ways}, {m.bias_feed, "bias.feed", sources * 2 * feet_count},
      {m.bias_offset, "bias.offset", sources * n2}, {m.bias_held, "bias.held_feed", sources * feet_count},
      {m.bias_printed, "bias.printed_feed", sources * feet_count}};
  for (const auto& [to, name, size] : plain) from.copy(to, size, name);
  for (int k = 0; k < int(ni) * ns; k++) {
    const double* row = m.inputs + k / ns * 2 * ns;
    m.input_norm[k] = std::hypot(row[k % ns], row[ns + k % ns]);
  }
  return mode;
}

}  // namespace tarsus::modal

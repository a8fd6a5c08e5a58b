// Between numpy and the engine: arrays copied in when a plan is made, vectors handed out when a batch is done.
#pragma once
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <stdexcept>
#include <string>
#include <vector>

#include "base/fields.hpp"

namespace tarsus {

namespace nb = nanobind;

template <class T>
using Array = nb::ndarray<const T, nb::numpy, nb::c_contig, nb::device::cpu>;
typedef Array<double> Doubles;
typedef Array<int64_t> Integers;

template <class T>
std::vector<T> copied(const Array<T>& array) {
  return std::vector<T>(array.data(), array.data() + array.size());
}

// A field of a Python object (a named tuple, a dataclass) as a vector.
template <class T>
std::vector<T> field(nb::handle group, const char* name) {
  return copied(nb::cast<Array<T>>(group.attr(name)));
}

// The fields that a dict holds: arrays, or single numbers.
struct Given : Fields {
  nb::dict from;

  explicit Given(nb::dict d) : from(std::move(d)) {}
  bool has(const std::string& name) const override { return from.contains(name.c_str()); }
  std::vector<double> doubles(const std::string& name) const override { return taken<double>(name); }
  std::vector<int64_t> integers(const std::string& name) const override { return taken<int64_t>(name); }

 private:
  template <class T>
  std::vector<T> taken(const std::string& name) const {
    if (!has(name)) throw std::invalid_argument("there is no " + name);
    const nb::object found = from[name.c_str()];
    return nb::isinstance<nb::float_>(found) || nb::isinstance<nb::int_>(found) ? std::vector<T>{nb::cast<T>(found)}
                                                                                : copied(nb::cast<Array<T>>(found));
  }
};

inline std::vector<uint8_t> booleans(nb::handle group, const char* name) {
  const auto array = nb::cast<Array<bool>>(group.attr(name));
  return std::vector<uint8_t>(array.data(), array.data() + array.size());
}

// A vector as a numpy array (size / width, width), or (size,) at width 0, without copying.
template <class T>
nb::object returned(std::vector<T>&& values, size_t width = 0) {
  auto* kept = new std::vector<T>(std::move(values));
  nb::capsule owner(kept, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
  if (width == 0) return nb::cast(nb::ndarray<T, nb::numpy>(kept->data(), {kept->size()}, owner));
  return nb::cast(nb::ndarray<T, nb::numpy>(kept->data(), {kept->size() / width, width}, owner));
}

// Rows of numbers, structs of doubles all, as a numpy array (size, width) without copying.
template <class Rows>
nb::object returned_rows(std::vector<Rows>&& rows) {
  static_assert(sizeof(Rows) % sizeof(double) == 0, "a row is made of doubles");
  auto* kept = new std::vector<Rows>(std::move(rows));
  nb::capsule owner(kept, [](void* p) noexcept { delete static_cast<std::vector<Rows>*>(p); });
  auto* first = reinterpret_cast<double*>(kept->data());
  return nb::cast(nb::ndarray<double, nb::numpy>(first, {kept->size(), sizeof(Rows) / sizeof(double)}, owner));
}

}  // namespace tarsus

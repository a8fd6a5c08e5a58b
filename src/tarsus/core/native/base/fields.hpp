// Named arrays of numbers, from which everything of a plan is made: Python hands them over, or a packet holds them.
#pragma once
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace tarsus {

// Both throw std::invalid_argument for a name that is not there.
struct Fields {
  virtual ~Fields() = default;
  virtual bool has(const std::string& name) const = 0;
  virtual std::vector<double> doubles(const std::string& name) const = 0;
  virtual std::vector<int64_t> integers(const std::string& name) const = 0;

  template <class To>
  std::vector<To> narrowed(const std::string& name) const {
    const std::vector<int64_t> from = integers(name);
    return std::vector<To>(from.begin(), from.end());
  }
  double number(const std::string& name) const { return sized(name, 1)[0]; }
  int64_t whole(const std::string& name) const {
    const std::vector<int64_t> found = integers(name);
    check(name, found.size() == 1);
    return found[0];
  }
  // An array that is known to have so many numbers.
  std::vector<double> sized(const std::string& name, size_t size) const {
    std::vector<double> found = doubles(name);
    check(name, found.size() == size);
    return found;
  }
  void copy(double* to, size_t size, const std::string& name) const {
    const std::vector<double> found = sized(name, size);
    std::copy(found.begin(), found.end(), to);
  }

  static void check(const std::string& name, bool fits) {
    if (!fits) throw std::invalid_argument(name + " has a wrong size");
  }
};

// The fields whose names begin so, by what is left of their names.
struct PartOf : Fields {
  const Fields& whole_of;
  const std::string head;

  PartOf(const Fields& whole, std::string begin) : whole_of(whole), head(std::move(begin)) {}
  bool has(const std::string& name) const override { return whole_of.has(head + name); }
  std::vector<double> doubles(const std::string& name) const override { return whole_of.doubles(head + name); }
  std::vector<int64_t> integers(const std::string& name) const override { return whole_of.integers(head + name); }
};

}  // namespace tarsus

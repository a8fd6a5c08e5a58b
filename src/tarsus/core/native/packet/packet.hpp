// A packet: named arrays one behind the other in one piece of memory, where they stay and may be changed between runs.
//
// Little-endian, in eights of bytes: "tarsus 1", the number of arrays, and of each its name (48 bytes, the rest zeros), 0 for
// doubles or 1 for whole numbers, how many, and the numbers. tarsus.solve.packet writes it.
#pragma once
#include <cstring>
#include <map>
#include <type_traits>

#include "base/fields.hpp"

namespace tarsus {

class Packet : public Fields {
 public:
  // Throws std::invalid_argument for what is no packet.
  Packet(char* at, size_t bytes) : end_(at + bytes) {
    if (bytes < 16 || std::memcmp(at, "tarsus 1", 8) != 0) throw std::invalid_argument("this is no packet of a plan");
    const int64_t count = whole_at(at + 8);
    at += 16;
    for (int64_t i = 0; i < count; i++) {
      const int64_t kind = room(at, HEAD) ? whole_at(at + NAME) : -1, numbers = kind < 0 ? 0 : whole_at(at + NAME + 8);
      if (kind < 0 || kind > 1 || at[NAME - 1] != 0 || numbers < 0 || numbers > (end_ - at - HEAD) / 8) throw std::invalid_argument("a packet of a plan is damaged");
      parts_[at] = {at + HEAD, size_t(numbers), kind == 1};
      at += HEAD + 8 * numbers;
    }
  }

  bool has(const std::string& name) const override { return parts_.count(name) != 0; }
  std::vector<double> doubles(const std::string& name) const override { return copied<double>(name); }
  std::vector<int64_t> integers(const std::string& name) const override { return copied<int64_t>(name); }

  // Where an array of so many numbers stands.
  template <class T>
  T* at(const std::string& name, size_t numbers) const {
    const Part& part = found<T>(name);
    check(name, part.numbers == numbers);
    return reinterpret_cast<T*>(part.first);
  }
  size_t size(const std::string& name) const { return has(name) ? parts_.at(name).numbers : 0; }

 private:
  static constexpr int NAME = 48, HEAD = NAME + 16;
  struct Part {
    char* first;
    size_t numbers;
    bool whole;
  };
  const char* end_;
  std::map<std::string, Part> parts_;

  static int64_t whole_at(const char* at) {
    int64_t out;
    std::memcpy(&out, at, 8);
    return out;
  }
  bool room(const char* at, int bytes) const { return end_ - at >= bytes; }
  template <class T>
  const Part& found(const std::string& name) const {
    const auto part = parts_.find(name);
    if (part == parts_.end()) throw std::invalid_argument("the packet has no " + name);
    if (part->second.whole != std::is_integral_v<T>) throw std::invalid_argument(name + " has numbers of another kind");
    return part->second;
  }
  template <class T>
  std::vector<T> copied(const std::string& name) const {
    const Part& part = found<T>(name);
    std::vector<T> out(part.numbers);
    if (part.numbers > 0) std::memcpy(out.data(), part.first, 8 * part.numbers);
    return out;
  }
};

}  // namespace tarsus

// Programs of laws for Python: their values and derivatives at many points, for tests and for what Python
// evaluates.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <string>

#include "laws/program.hpp"

namespace nb = nanobind;
namespace tarsus {
namespace {

using Code = nb::ndarray<const int32_t, nb::shape<-1, 4>, nb::c_contig, nb::device::cpu>;
using List = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Table = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Result = nb::ndarray<nb::numpy, double>;

Program linked(const Code& code, const List& constants, const Table& arguments,
                const List& parameters) {
  return link(code.data(), int(code.shape(0)), constants.data(), int(constants.shape(0)),
              int(arguments.shape(0)), int(parameters.shape(0)));
}

Result fresh(std::initializer_list<size_t> shape) {
  size_t size = 1;
  for (size_t n : shape) size *= n;
  double* data = new double[size];
  return Result(data, shape, nb::capsule(data, [](void* p) noexcept { delete[] static_cast<double*>(p); }));
}

Row loaded(const double* at, int count) {
  if (count >= N) return load(at);
  Row out(at[0]);
  for (int j = 1; j < count; j++) out.set(j, at[j]);
  return out;
}

void stored(double* at, int count, const Row& row) {
  if (count >= N) return store(at, row);
  for (int j = 0; j < count; j++) at[j] = row[j];
}

Result evaluate_rows(const Code& code, const List& constants, const Table& arguments,
                const List& parameters) {
  const Program program = linked(code, constants, arguments, parameters);
  const size_t k = arguments.shape(1);
  Result out = fresh({k});
  std::vector<double> fixed(program.fixed());
  std::vector<Row> registers(program.registers());
  prepare(program, parameters.data(), fixed.data());
  nb::gil_scoped_release release;
  for (size_t j = 0; j < k; j += N) {
    const int count = int(std::min<size_t>(N, k - j));
    for (int i = 0; i < program.arguments; i++) registers[i] = loaded(arguments.data() + i * k + j, count);
    stored(out.data() + j, count, evaluate(program, fixed.data(), registers.data()));
  }
  return out;
}

Result evaluate_slopes(const Code& code, const List& constants, const Table& arguments,
                const List& parameters) {
  const Program program = linked(code, constants, arguments, parameters);
  const size_t k = arguments.shape(1);
  Result out = fresh({size_t(program.arguments), k});
  std::vector<double> fixed(program.fixed());
  std::vector<Dual<1>> registers(program.registers());
  prepare(program, parameters.data(), fixed.data());
  for (int by = 0; by < program.arguments; by++) {
    for (size_t j = 0; j < k; j += N) {
      const int count = int(std::min<size_t>(N, k - j));
      for (int i = 0; i < program.arguments; i++) {
        registers[i] = Dual<1>(loaded(arguments.data() + i * k + j, count));
        if (i == by) registers[i].slope[0] = Row(1.0);
      }
      stored(out.data() + by * k + j, count, evaluate(program, fixed.data(), registers.data()).slope[0]);
    }
  }
  return out;
}

std::vector<std::string> operations() {
  return {
#define X(name) #name,
      TARSUS_OPERATIONS(X)
#undef X
  };
}

}  // namespace

void bind_program(nb::module_& m) {
  m.def("operations", &operations, "Names of the operations, in the order that programs number them.");
  m.def("evaluate", &evaluate_rows, nb::arg("code"), nb::arg("constants"), nb::arg("arguments"),
        nb::arg("parameters"),
        "Values (k,) of a law's program at arguments (na, k) and parameters (np,), eight at a time.");
  m.def("evaluate_slopes", &evaluate_slopes, nb::arg("code"), nb::arg("constants"), nb::arg("arguments"),
        nb::arg("parameters"), "Derivatives (na, k) of the value by every argument.");
}

}  // namespace tarsus

// SPDX-License-Identifier: Apache-2.0
// Scans over whole recordings: medians, noise of the depth, origin of a rise, lag of a force.
#include <nanobind/stl/optional.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <vector>

#include "fit/depth_noise.hpp"
#include "fit/lag.hpp"
#include "fit/lagged.hpp"
#include "fit/median.hpp"
#include "fit/origin.hpp"
#include "fit/outliers.hpp"
#include "fit/sliding_start.hpp"
#include "fit/windows.hpp"
#include "module.hpp"

namespace nb = nanobind;

namespace needleforce::python {

namespace {

std::span<const double> span_of(const Values& values) { return {values.data(), values.shape(0)}; }

/// Memory that is not set to zero first.
class Scratch {
 public:
  explicit Scratch(std::size_t n) : memory_(std::make_unique_for_overwrite<double[]>(n)), size_(n) {}
  operator std::span<double>() const { return {memory_.get(), size_}; }

 private:
  std::unique_ptr<double[]> memory_;
  std::size_t size_;
};

double median(const Values& values) {
  const Scratch scratch(values.shape(0));
  const std::span<double> copy = scratch;
  std::copy_n(values.data(), copy.size(), copy.begin());
  return fit::median(copy);
}

/// The median of the steps from value to value, or of their magnitudes.
double median_step(const Values& values, bool magnitude) {
  const std::size_t n = std::max<std::size_t>(values.shape(0), 1) - 1;
  const Scratch scratch(n);
  const std::span<double> steps = scratch;
  for (std::size_t i = 0; i < n; ++i) steps[i] = values.data()[i + 1] - values.data()[i];
  if (magnitude)
    for (double& step : steps) step = std::abs(step);
  return fit::median(steps);
}

double quantum_of(const Values& values) { return fit::quantum_of(span_of(values)); }

/// Numbers of the samples that lie far from their neighbours, see fit::OutlierLimits.
nb::list outliers(const Values& force, double level, double quantum, double max_span, double margin,
                  std::size_t local, std::size_t common) {
  nb::list found;
  if (force.shape(0) < 20) throw nb::value_error("outliers need 20 samples");
  fit::outliers(span_of(force), {level, quantum, max_span, margin, local, common},
                Scratch(3 * force.shape(0)), [&](std::size_t i) { found.append(i); });
  return found;
}

std::size_t sliding_start(const Values& depth, const Values& force, double bin, std::size_t ahead,
                          std::size_t max_bins) {
  if (depth.shape(0) != force.shape(0)) throw nb::value_error("depth and force differ in length");
  return fit::sliding_start({span_of(depth), span_of(force)}, {bin, ahead, max_bins},
                            Scratch(2 * max_bins + 2));
}

double second_difference_noise(const Values& values) {
  return fit::second_difference_noise(span_of(values), Scratch(values.shape(0)));
}

bool noise_exceeds(const Values& values, double limit) {
  return fit::noise_exceeds(span_of(values), limit, Scratch(values.shape(0)));
}

Output running_max(const Values& values) {
  double* out;
  Output array = new_array(values.shape(0), out);
  fit::running_max(span_of(values), {out, values.shape(0)});
  return array;
}

double depth_noise(const Values& depth) { return fit::depth_noise(span_of(depth), Scratch(depth.shape(0))); }

Output moving_average(const Values& values, std::size_t half) {
  double* out;
  Output array = new_array(values.shape(0), out);
  if (values.shape(0) > 0)
    fit::moving_average(span_of(values), half, Scratch(values.shape(0) + 1), {out, values.shape(0)});
  return array;
}

using Rows = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

/// Sums of products (p, p) of every two of the rows (p, n), over the columns from `first` up to `last`.
nb::ndarray<nb::numpy, double, nb::ndim<2>, nb::c_contig> gram(const Rows& rows, std::size_t first,
                                                               std::optional<std::size_t> last) {
  const std::size_t p = rows.shape(0), n = rows.shape(1), end = last.value_or(n);
  if (first > end || end > n) throw nb::value_error("no such columns");
  double* sums;
  const Output flat = new_array(p * p, sums);
  for (std::size_t i = 0; i < p; ++i)
    for (std::size_t k = 0; k <= i; ++k)
      sums[i * p + k] = sums[k * p + i] = fit::product_of({rows.data() + i * n + first, end - first},
                                                          {rows.data() + k * n + first, end - first});
  return {flat.data(), {p, p}, nb::cast(flat)};
}

/// Fall, excess, bent fall and excess with a line, (4, k), of two windows of a series without its mean.
nb::ndarray<nb::numpy, double, nb::ndim<2>, nb::c_contig> compare_windows(const Values& centred,
                                                                          std::size_t window, std::size_t gap,
                                                                          bool near_end) {
  const fit::Windows windows{window, gap, near_end};
  const std::size_t n = centred.shape(0), count = windows.places(n);
  if (window < 2 || count == 0) throw nb::value_error("the series is shorter than two windows");
  double* data;
  const Output flat = new_array(4 * count, data);
  const auto row = [&](std::size_t k) { return std::span(data + k * count, count); };
  fit::compare_windows(span_of(centred), windows, Scratch(4 * n + 2), {row(0), row(1), row(2), row(3)});
  return {flat.data(), {4, count}, nb::cast(flat)};
}

/// The magnitude about the upper median below which the share 1 / part of the values lies.
double spread_of_part(const Values& values, std::size_t part) {
  if (part < 1) throw nb::value_error("part must be 1 or more");
  return fit::spread_of_part(span_of(values), part, Scratch(values.shape(0)));
}

/// Means of consecutive blocks of `size` values; what does not fill the last one is left out.
Output block_means(const Values& values, std::size_t size) {
  if (size < 1) throw nb::value_error("size must be 1 or more");
  const std::size_t count = values.shape(0) / size;
  double* means;
  Output array = new_array(count, means);
  for (std::size_t k = 0; k < count; ++k)
    means[k] = fit::pairwise_sum({values.data() + k * size, size}) / static_cast<double>(size);
  return array;
}

/// Where the first run of `length` values above a level starts; None without one.
std::optional<std::size_t> first_run(const Values& values, double level, std::size_t length) {
  const std::size_t found = fit::first_run(span_of(values), level, length);
  return found < values.shape(0) ? std::optional(found) : std::nullopt;
}

/// The sum of products of two series.
double product(const Values& a, const Values& b) {
  if (a.shape(0) != b.shape(0)) throw nb::value_error("the series differ in length");
  return fit::product_of(span_of(a), span_of(b));
}

/// Depth of the origin and the earliest that is not excluded [m], baseline [N] and variance [N²] of a rise.
nb::tuple fit_origin(const Values& depth, const Values& force, double noise, double max_rise,
                     std::size_t min_free) {
  if (depth.shape(0) != force.shape(0) || depth.shape(0) == 0)
    throw nb::value_error("depth and force are empty or differ in length");
  const fit::Origin found =
      fit::fit_origin({span_of(depth), span_of(force)}, {noise, max_rise, min_free}, Scratch(force.shape(0)));
  return nb::make_tuple(found.depth, found.earliest, found.baseline, found.variance);
}

/// Sample numbers of the alternating minima and maxima of a depth, at least `min_travel` apart.
nb::list reversals(const Values& depth, double min_travel) {
  nb::list found;
  fit::reversals(span_of(depth), min_travel, [&](std::size_t i) { found.append(i); });
  return found;
}

/// Least sums of squares [N²] of a force that follows a travel, one for each lag.
Output squares_by_lag(const Values& time, const Values& force, const Values& travel_time,
                      const Values& travel, const Values& lags, const Values& stretches, double least,
                      bool linearly) {
  const std::size_t n = time.shape(0);
  if (n == 0 || force.shape(0) != n || travel_time.shape(0) == 0 || travel.shape(0) != travel_time.shape(0))
    throw nb::value_error("time and values are empty or differ in length");
  double* squares;
  Output array = new_array(lags.shape(0), squares);
  fit::squares_by_lag({span_of(time), span_of(force), span_of(travel_time), span_of(travel)},
                      linearly ? fit::Follows::linearly : fit::Follows::exponentially, span_of(lags),
                      span_of(stretches), least, Scratch(3 * n), {squares, lags.shape(0)});
  return array;
}

}  // namespace

void bind_scan(nb::module_& module) {
  module.def("median", &median, nb::arg("values"));
  module.def("median_step", &median_step, nb::arg("values"), nb::arg("magnitude") = false);
  module.def("quantum_of", &quantum_of, nb::arg("values"));
  module.def("outliers", &outliers, nb::arg("force"), nb::arg("level"), nb::arg("quantum"),
             nb::arg("max_span"), nb::arg("margin"), nb::arg("local"), nb::arg("common"));
  module.def("sliding_start", &sliding_start, nb::arg("depth"), nb::arg("force"), nb::arg("bin"),
             nb::arg("ahead"), nb::arg("max_bins"));
  module.def("second_difference_noise", &second_difference_noise, nb::arg("values"));
  module.def("noise_exceeds", &noise_exceeds, nb::arg("values"), nb::arg("limit"));
  module.def("running_max", &running_max, nb::arg("values"));
  module.def("depth_noise", &depth_noise, nb::arg("depth"));
  module.def("moving_average", &moving_average, nb::arg("values"), nb::arg("half"));
  module.def("gram", &gram, nb::arg("rows"), nb::arg("first") = 0, nb::arg("last") = nb::none());
  module.def("product", &product, nb::arg("a"), nb::arg("b"));
  module.def("compare_windows", &compare_windows, nb::arg("centred"), nb::arg("window"), nb::arg("gap"),
             nb::arg("near_end"));
  module.def("spread_of_part", &spread_of_part, nb::arg("values"), nb::arg("part"));
  module.def("block_means", &block_means, nb::arg("values"), nb::arg("size"));
  module.def("first_run", &first_run, nb::arg("values"), nb::arg("level"), nb::arg("length"));
  module.def("fit_origin", &fit_origin, nb::arg("depth"), nb::arg("force"), nb::arg("noise"),
             nb::arg("max_rise"), nb::arg("min_free"));
  module.def("reversals", &reversals, nb::arg("depth"), nb::arg("min_travel"));
  module.def("squares_by_lag", &squares_by_lag, nb::arg("time"), nb::arg("force"), nb::arg("travel_time"),
             nb::arg("travel"), nb::arg("lags"), nb::arg("stretches"), nb::arg("least"), nb::arg("linearly"));
}

}  // namespace needleforce::python

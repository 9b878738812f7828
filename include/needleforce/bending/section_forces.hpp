// SPDX-License-Identifier: Apache-2.0
// A needle whose sections differ: what it gives back as they move past its shape, and what turns it.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "beam_foundation.hpp"

namespace needleforce::bending {

/// A section above the surface, as an exact beam-column.
struct Column {
  std::size_t section;
  double length;
  ColumnStiffness stiffness;
};
using Columns = std::array<Column, max_sections + 1>;

/// The sections of the needle in the element of length h that begins at a depth, from the base on, each with
/// the part of the element that it takes.
template <class Visit>
void each_section(const Sections& sections, double from, double h, double embedded, Visit visit) noexcept {
  for (std::size_t k = sections.count; k-- > 0;) {
    const double begin = std::max(from, embedded - sections.list[k].end);
    const double end = k > 0 ? std::min(from + h, embedded - sections.list[k - 1].end) : from + h;
    if (begin < end) visit(sections.list[k], (begin - from) / h, (end - from) / h);
  }
}
/// How much the slope of the shape functions changes along a part of an element [1/m].
inline std::array<double, 4> change_of_slope(double first, double second, double h) noexcept {
  const auto before = hermite_slope(first), after = hermite_slope(second);
  std::array<double, 4> change;
  for (std::size_t n = 0; n < 4; ++n) change[n] = (after[n] - before[n]) / h;
  return change;
}

/// Forces of sections at a shape.
template <std::size_t dimension>
class SectionForces {
 public:
  using Load = BeamLoad<dimension>;

  SectionForces(const BeamMesh<dimension>& mesh, const Columns& columns, const Sections& sections,
                const Load& load) noexcept
      : mesh_(mesh), columns_(columns), sections_(sections), load_(load) {}

  /// The moment about the axis is that of each section's own curvature, across the plane in which it points
  /// [N m]. Wait-free.
  double turning() const noexcept {
    double sum = 0.0;
    if (!sections_.bent()) return sum;
    for (std::size_t i = 0; i < mesh_.surface(); ++i)
      sum += turned(i, sections_.list[columns_[i].section], 0.0, 1.0);
    for (std::size_t i = mesh_.surface(); i + 1 < mesh_.count(); ++i)
      each_section(sections_, mesh_[i].travel, mesh_.h(), load_.embedded,
                   [&](const Section& section, double first, double second) {
                     sum += turned(i, section, first, second);
                   });
    return sum;
  }
  /// What bending gains as the section moves down at a place where it changes [N]. Wait-free.
  double advancing() const noexcept {
    double sum = 0.0;
    if (sections_.count < 2) return sum;
    for (std::size_t i = 1; i < mesh_.surface(); ++i)
      sum += given_back(i, sections_.list[columns_[i].section]) -
             given_back(i, sections_.list[columns_[i - 1].section]);
    for (std::size_t i = mesh_.surface(); i + 1 < mesh_.count(); ++i) {
      const Section* above = nullptr;
      each_section(sections_, mesh_[i].travel, mesh_.h(), load_.embedded,
                   [&](const Section& section, double first, double) {
                     if (above) sum += energy_at(i, *above, first) - energy_at(i, section, first);
                     above = &section;
                   });
    }
    return sum;
  }

 private:
  /// Energy per length [N] that an element has at xi if it is of a section.
  double energy_at(std::size_t i, const Section& section, double xi) const noexcept {
    const auto &a = mesh_[i], &b = mesh_[i + 1];
    const double h = mesh_.h(), per_square = 1.0 / (h * h);
    double sum = 0.0;
    for (std::size_t d = 0; d < dimension; ++d) {
      const double bend = per_square * ((12.0 * xi - 6.0) * (a.place[d] - b.place[d]) +
                                        h * ((6.0 * xi - 4.0) * a.slope[d] + (6.0 * xi - 2.0) * b.slope[d])) -
                          section.curvature * load_.bend[d];
      sum += 0.5 * section.stiffness * bend * bend;
    }
    return sum;
  }
  /// Energy [N], M^2 / 2 EI + M curvature, that a section gives back per length at the upper end of column i.
  double given_back(std::size_t i, const Section& section) const noexcept {
    const Column& own = columns_[i];
    const Section& below = sections_.list[own.section];
    const auto &a = mesh_[i], &b = mesh_[i + 1];
    const auto& [s11, s12, s22, s24] = own.stiffness.value;
    const double unit = below.stiffness / own.length;
    double sum = 0.0;
    for (std::size_t d = 0; d < dimension; ++d) {
      const double moment =
          -unit * (s12 * (a.place[d] - b.place[d]) / own.length + s22 * a.slope[d] + s24 * b.slope[d]) -
          below.stiffness * below.curvature * load_.bend[d];
      sum += moment * (0.5 * moment / section.stiffness + section.curvature * load_.bend[d]);
    }
    return sum;
  }
  double turned(std::size_t i, const Section& section, double first, double second) const noexcept {
    const auto &a = mesh_[i], &b = mesh_[i + 1];
    const double length = b.travel - a.travel;
    const auto change = change_of_slope(first, second, length);
    double across = 0.0;
    for (std::size_t d = 0; d < dimension; ++d)
      across += load_.bend_turns[d] * (change[0] * a.place[d] + change[1] * length * a.slope[d] +
                                       change[2] * b.place[d] + change[3] * length * b.slope[d]);
    return section.stiffness * section.curvature * across;
  }

  const BeamMesh<dimension>& mesh_;
  const Columns& columns_;
  const Sections& sections_;
  const Load& load_;
};

}  // namespace needleforce::bending

// SPDX-License-Identifier: Apache-2.0
#include "needleforce_bend.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <new>
#include <type_traits>

#include "bend_in_memory.hpp"

using namespace needleforce;
using bending::LateralLayer;
using InLayers = bending::SpatialInsertion;
using InSolid = solid::BentInSolid<2>;

namespace {

constexpr std::size_t snapshot_size = std::max(sizeof(InLayers::Saved), sizeof(InSolid::Saved));

bool read_form(const char* form, LateralLayer& layer, nf_fault& why) noexcept {
  layer.form = FoundationForm::linear;
  if (!form) return true;
  for (std::size_t i = 0; i < foundation_form_names.size(); ++i)
    if (c::same(form, foundation_form_names[i])) {
      layer.form = static_cast<FoundationForm>(i);
      return true;
    }
  return c::refuse(why, LateralLayer::name, "form", "is none of linear, cubic, hyperbolic, tanh");
}

bool read_layers(const nf_bending& given, bending::BeamProperties& beam, nf_fault& why) noexcept {
  const std::size_t most = bending::max_lateral_layers;
  if (!given.layers || given.layer_count < 1 || given.layer_count > most)
    return c::refuse(why, "bending", "layer_count", "is outside its range", double(given.layer_count), 1.0,
                     double(most));
  beam.layer_count = given.layer_count;
  for (why.layer = 0; why.layer < given.layer_count; ++why.layer) {
    const nf_lateral_layer& named = given.layers[why.layer];
    LateralLayer& layer = beam.layers[why.layer];
    if (!c::fill(layer, named.parameters, why) || !read_form(named.form, layer, why)) return false;
  }
  why.layer = 0;
  return true;
}

bool read_sections(const nf_bending& given, bending::BeamProperties& beam, nf_fault& why) noexcept {
  const std::size_t most = bending::max_sections;
  if (!given.sections || given.section_count < 1 || given.section_count > most)
    return c::refuse(why, "bending", "section_count", "is outside its range", double(given.section_count),
                     1.0, double(most));
  std::array<bending::Section, most> list;
  for (std::size_t i = 0; i < given.section_count; ++i)
    list[i] = {given.sections[i].end, given.sections[i].stiffness, given.sections[i].curvature};
  beam.sections = bending::Sections(std::span<const bending::Section>(list.data(), given.section_count));
  return beam.sections.valid() ||
         c::refuse(why, "bending", "sections",
                   "have ends that do not increase, or stiffnesses outside 1e-15 to 1e9");
}

/// The parameters of both tables, each to its own.
bool read_parameters(const nf_bending& given, bending::FlexibleSettings& settings, nf_fault& why) noexcept {
  constexpr std::size_t most = bending::Support::table.size() + bending::Bending::table.size();
  if ((!given.parameters && given.parameter_count) || given.parameter_count > most)
    return c::refuse(why, "bending", "parameter_count", "is outside its range", double(given.parameter_count),
                     0.0, double(most));
  std::array<nf_parameter, most> support, lengths;
  std::size_t n = 0, m = 0;
  for (std::size_t i = 0; i < given.parameter_count; ++i) {
    const nf_parameter& each = given.parameters[i];
    (c::parameter_named<bending::Support>(each.name) ? support[n++] : lengths[m++]) = each;
  }
  return c::fill(settings.beam.support, std::span<const nf_parameter>(support.data(), n), why) &&
         c::fill(settings.lengths, std::span<const nf_parameter>(lengths.data(), m), why);
}

bool read(const nf_bending* given, bending::FlexibleSettings& settings, nf_fault& why) noexcept {
  if (!given) return c::refuse(why, "bending", "bending", "is missing");
  if (given->elements) settings.beam.elements = static_cast<std::size_t>(given->elements);
  if (!read_layers(*given, settings.beam, why) || !read_sections(*given, settings.beam, why) ||
      !read_parameters(*given, settings, why))
    return false;
  const char* quantity = bending::fault(settings);
  return !quantity || c::refuse(why, "bending", quantity, "is outside its range or out of order");
}

template <class Needle, class Axial>
nf_bend* made(void* memory, size_t size, const Axial* axial, const nf_bending* given,
              nf_fault* why) noexcept {
  nf_fault ignored{};
  nf_fault& fault = why ? *why : ignored;
  fault = nf_fault{};
  bending::FlexibleSettings settings;
  if (!axial && !c::refuse(fault, "bending", "axial", "is missing")) return nullptr;
  if (!c::holds<nf_bend>(memory, size, fault) || !read(given, settings, fault)) return nullptr;
  return new (memory) nf_bend{Needle(axial->insertion, settings)};
}

}  // namespace

extern "C" {

size_t nf_bend_size(void) { return sizeof(nf_bend); }

nf_bend* nf_bend_init(void* memory, size_t size, const nf_insertion* axial, const nf_bending* given,
                      nf_fault* why) {
  return made<InLayers>(memory, size, axial, given, why);
}
nf_bend* nf_bend_init_in_solid(void* memory, size_t size, const nf_solid* axial, const nf_bending* given,
                               nf_fault* why) {
  return made<InSolid>(memory, size, axial, given, why);
}

void nf_bend_step(nf_bend* self, const nf_base* base, double dt, nf_bent* out) {
  *out = c::plain(
      c::with(self->needle, [&](auto& needle) noexcept { return needle.step(c::base_of(*base), dt); }));
}

size_t nf_bend_shape(const nf_bend* self, double* points, size_t count) {
  std::size_t n = 0;
  c::with(self->needle, [&](const auto& needle) noexcept {
    needle.shape([&](const bending::Vector& point) noexcept {
      if (n++ < count) points = std::copy(point.begin(), point.end(), points);
    });
  });
  return n;
}

void nf_bend_reset(nf_bend* self) {
  c::with(self->needle, [](auto& needle) noexcept { needle.reset(); });
}

size_t nf_bend_snapshot_size(void) { return snapshot_size; }

int nf_bend_snapshot(const nf_bend* self, void* bytes, size_t size) {
  if (!bytes || size < snapshot_size) return 0;
  c::with(self->needle, [&](const auto& needle) noexcept {
    const auto saved = needle.save();
    std::memset(bytes, 0, snapshot_size);
    std::memcpy(bytes, &saved, sizeof saved);
  });
  return 1;
}

int nf_bend_restore(nf_bend* self, const void* bytes, size_t size) {
  if (!bytes || size < snapshot_size) return 0;
  return c::with(self->needle, [&](auto& needle) noexcept {
    typename std::remove_cvref_t<decltype(needle)>::Saved saved;
    std::memcpy(&saved, bytes, sizeof saved);
    const auto* all = static_cast<const unsigned char*>(bytes);
    const bool clean =
        std::all_of(all + sizeof saved, all + snapshot_size, [](unsigned char byte) { return byte == 0; });
    return int(clean && needle.restore(saved));
  });
}

}  // extern "C"

// SPDX-License-Identifier: Apache-2.0
// The settings of a needle that bends as the C face takes them, by name, and that face itself.
#pragma once

#include <cstring>
#include <vector>

#include "../../bindings/c/needleforce_bend.h"
#include "needleforce/bending/flexible_insertion.hpp"
#include "trial.hpp"

namespace needleforce::proof {

/// The plain structs of some settings.
class CBending {
 public:
  explicit CBending(const bending::FlexibleSettings& settings) {
    const bending::BeamProperties& beam = settings.beam;
    for (std::size_t i = 0; i < std::min(beam.layer_count, bending::max_lateral_layers); ++i) {
      layers_[i].form = foundation_form_names[std::size_t(beam.layers[i].form)];
      name_parameters(beam.layers[i], layers_[i].parameters);
    }
    for (std::size_t i = 0; i < beam.sections.count; ++i) {
      const auto& [end, stiffness, curvature] = beam.sections.list[i];
      sections_[i] = {end, stiffness, curvature};
    }
    name_parameters(settings.lengths, name_parameters(beam.support, parameters_));
    bending_ = {layers_,     beam.layer_count,       sections_,         beam.sections.count,
                parameters_, std::size(parameters_), int(beam.elements)};
  }
  const nf_bending* get() const { return &bending_; }

 private:
  template <class T>
  static nf_parameter* name_parameters(const T& value, nf_parameter* parameters) {
    for (const auto& parameter : T::table) *parameters++ = {parameter.name, value.*parameter.member};
    return parameters;
  }
  nf_lateral_layer layers_[bending::max_lateral_layers]{};
  nf_section sections_[bending::max_sections]{};
  nf_parameter parameters_[bending::Support::table.size() + bending::Bending::table.size()]{};
  nf_bending bending_{};
};

/// The C face of a needle that bends; without a needle where it refused.
class CNeedle {
 public:
  CNeedle(const CFace& axial, const bending::FlexibleSettings& settings)
      : memory_(nf_bend_size() / sizeof(double) + 1), kept_(nf_bend_snapshot_size()) {
    const CBending bending(settings);
    nf_fault why{};
    needle_ = nf_bend_init(memory_.data(), nf_bend_size(), axial.get(), bending.get(), &why);
    require((needle_ == nullptr) == (why.reason != nullptr), "a refusal of a needle has a reason");
    keep();
  }
  bool made() const { return needle_; }
  nf_bent step(const bending::Base& base, double dt) {
    const nf_base at{base.depth, {base.lateral[0], base.lateral[1]}, {base.tilt[0], base.tilt[1]}, base.roll};
    nf_bent sample;
    nf_bend_step(needle_, &at, dt, &sample);
    return sample;
  }
  std::size_t shape_points() const { return nf_bend_shape(needle_, nullptr, 0); }
  void reset() { nf_bend_reset(needle_); }
  void keep() {
    if (needle_) require(nf_bend_snapshot(needle_, kept_.data(), kept_.size()) == 1, "a snapshot is taken");
  }
  void restore() {
    require(nf_bend_restore(needle_, kept_.data(), kept_.size()) == 1, "a snapshot is taken back");
  }
  /// One byte changed, or the last ones missing.
  void restore_altered(std::size_t where, std::uint8_t change) {
    std::uint8_t& byte = kept_[where % kept_.size()];
    const std::uint8_t before = byte;
    byte ^= change ? change : 1;
    require(nf_bend_restore(needle_, kept_.data(), kept_.size()) == 0, "altered bytes are refused");
    byte = before;
    require(nf_bend_restore(needle_, kept_.data(), kept_.size() - 1) == 0, "missing bytes are refused");
  }

 private:
  std::vector<double> memory_;
  std::vector<std::uint8_t> kept_;
  nf_bend* needle_ = nullptr;
};

}  // namespace needleforce::proof

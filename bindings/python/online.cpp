// SPDX-License-Identifier: Apache-2.0
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/variant.h>
#include <nanobind/stl/vector.h>

#include "module.hpp"
#include "needleforce/online/online_identifier.hpp"
#include "needleforce/online/prior_flaw.hpp"
#include "one_thread.hpp"
#include "parameters.hpp"
#include "saved_bytes.hpp"

namespace needleforce::python {

namespace {

using events::Detection;
using online::Expected;
using online::ForceAhead;
using online::LayerLearnt;
using online::LayerPrior;
using online::Learnt;
using online::OnlineIdentifier;
using online::OnlinePrior;
using online::OnlineSettings;

using Pair = std::array<double, 2>;
using Triple = std::array<double, 3>;

LayerPrior layer_from(const std::vector<Pair>& row) {
  LayerPrior layer{};
  Expected* const fields[] = {&layer.modulus, &layer.cutting,  &layer.friction,
                              &layer.top,     &layer.puncture, &layer.remainder};
  for (std::size_t i = 0; i < std::min<std::size_t>(row.size(), 6); ++i) *fields[i] = {row[i][0], row[i][1]};
  return layer;
}

OnlinePrior prior_from(const std::vector<std::vector<Pair>>& layers, std::size_t count, bool same_tissue,
                       double radius, const Tip& tip, const std::vector<Pair>& earlier, double spacing) {
  OnlinePrior prior{};
  prior.layers = count;
  prior.same_tissue = same_tissue;
  prior.radius = radius;
  if (earlier.size() == online::EarlierInsertions::points) prior.earlier.spacing = spacing;
  for (std::size_t i = 0; i < std::min(earlier.size(), online::EarlierInsertions::points); ++i) {
    prior.earlier.mean[i] = earlier[i][0];
    prior.earlier.sd[i] = earlier[i][1];
  }
  prior.tip = tip;
  for (std::size_t i = 0; i < std::min(layers.size(), online::most_layers); ++i)
    prior.layer[i] = layer_from(layers[i]);
  return prior;
}

void check_prior(const OnlinePrior& prior) {
  const tips::Flaw flaw = flaw_of(prior);
  if (!flaw.limit) return;
  std::string quantity = std::string("prior.") + flaw.quantity;
  if (flaw.index >= 0) quantity.append("[").append(std::to_string(flaw.index)).append("]");
  raise_input(quantity, nb::float_(flaw.value), flaw.limit, flaw.next_step);
}

Triple row(const Learnt& value) { return {value.value, value.sd, value.before}; }

nb::dict layer_of(const OnlineIdentifier& self, std::size_t k) {
  const LayerLearnt layer = self.layer(k);
  nb::dict result;
  result["modulus"] = row(layer.modulus);
  result["cutting"] = row(layer.cutting);
  result["friction"] = row(layer.friction);
  result["top"] = layer.top;
  result["puncture_depth"] = layer.puncture_depth;
  result["puncture_force"] = layer.puncture_force;
  result["remaining"] = layer.remaining;
  result["probability"] = layer.probability;
  result["touched"] = layer.touched;
  result["pierced"] = layer.pierced;
  return result;
}

nb::dict ahead_of(const OnlineIdentifier& self, double travel) {
  const ForceAhead found = self.ahead(travel);
  std::vector<double> depth, force, low, high;
  for (const online::PointAhead& each : found.at) {
    depth.push_back(each.depth);
    force.push_back(each.force);
    low.push_back(each.low);
    high.push_back(each.high);
  }
  nb::dict result;
  result["depth"] = depth;
  result["force"] = force;
  result["low"] = low;
  result["high"] = high;
  result["puncture_probability"] = found.puncture_probability;
  result["puncture"] = Triple{found.puncture_depth, found.earliest, found.latest};
  return result;
}

}  // namespace

void bind_online(nb::module_& module) {
  bind_parameters<OnlineSettings>(module, "OnlineSettings");
  EngineClass<OnlineIdentifier>(module, "OnlineIdentifier", "Parameters learnt while a needle moves.")
      .def(
          "__init__",
          [](OnlineIdentifier* self, const std::vector<std::vector<Pair>>& layers, std::size_t count,
             bool same_tissue, double radius, const Tip& tip, const std::vector<Pair>& earlier,
             double spacing, const OnlineSettings& settings, const events::EventSettings& watched) {
            const OnlinePrior prior = prior_from(layers, count, same_tissue, radius, tip, earlier, spacing);
            check_prior(prior);
            new (self) OnlineIdentifier(prior, settings, watched);
          },
          nb::arg("layers"), nb::arg("count"), nb::arg("same_tissue"), nb::arg("radius"), nb::arg("tip"),
          nb::arg("earlier"), nb::arg("spacing"), nb::arg("settings"), nb::arg("watched"))
      .def(
          "step",
          [](OnlineIdentifier& self, double force, double depth, double dt) -> std::optional<Detection> {
            const Detection found = self.step(force, depth, dt);
            if (found.kind == events::EventKind::none) return std::nullopt;
            return found;
          },
          nb::arg("force"), nb::arg("depth"), nb::arg("dt"),
          "One sample: force [N], depth [m], time since the one before [s].")
      .def("reset", &OnlineIdentifier::reset)
      .def("copy", &OnlineIdentifier::snapshot, "Another one that has seen the same.")
      .def("save", &saved_bytes<OnlineIdentifier>, "What it has seen, as bytes that any process may keep.")
      .def(
          "restore",
          [](OnlineIdentifier& self, const nb::bytes& bytes) {
            restore_bytes(self, bytes, "not of this version, this prior and these settings, or altered",
                          "Give what save() of an identifier with the same prior and settings gave.");
          },
          nb::arg("snapshot"), "What another one has seen, from bytes of save().")
      .def("layer", &layer_of, nb::arg("k"), "What is known of a layer, 0 the first.")
      .def("ahead", &ahead_of, nb::arg("travel"), "The force over the next travel [m].")
      .def_prop_ro("status",
                   [](const OnlineIdentifier& self) {
                     return events::stream_status_names[static_cast<std::size_t>(self.status())];
                   })
      .def_prop_ro("regime",
                   [](const OnlineIdentifier& self) {
                     return online::regime_names[static_cast<std::size_t>(self.regime())];
                   })
      .def_prop_ro("pierced", &OnlineIdentifier::pierced, "how many layers are pierced")
      .def_prop_ro(
          "surface", [](const OnlineIdentifier& self) { return row(self.surface()); },
          "where the tissue begins [m]")
      .def_prop_ro("settings", &OnlineIdentifier::settings)
      .def_prop_ro("depth", &OnlineIdentifier::depth, "of the last sample [m]")
      .def_prop_ro("force", &OnlineIdentifier::force, "of the last sample [N]")
      .def_prop_ro("speed", &OnlineIdentifier::speed, "now [m/s]")
      .def_prop_ro("zero", &OnlineIdentifier::zero, "what the sensor reads without a force [N]")
      .def_prop_ro(
          "noise", [](const OnlineIdentifier& self) { return self.detector().noise(); },
          "standard deviation of a reading [N]")
      .def_prop_ro("innovation", &OnlineIdentifier::innovation, "normalised innovation squared [1]")
      .def_prop_ro("changes", &OnlineIdentifier::changes, "changes of the tissue found");
}

}  // namespace needleforce::python

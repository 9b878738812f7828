// SPDX-License-Identifier: Apache-2.0
// A fuzzer on priors, settings and streams of what learns while the needle moves: runs at one speed, forces
// that follow a contact and slide, falls, single odd samples, other needles, resets, bytes kept, taken back
// and planted.
#include "learn_trial.hpp"

namespace {

using namespace needleforce;
using from_bytes::Bytes;
using online::Expected;

Expected expected(Bytes& bytes, double most) {
  if (bytes.below(2) == 0) return {};
  const double mean = bytes.number(-1e-3 * most, most);
  return {mean, bytes.number(1e-6 * most, most)};
}

/// As a tissue may have it, or anything.
online::OnlinePrior prior_from(Bytes& bytes) {
  online::OnlinePrior prior;
  prior.layers = bytes.below(online::most_layers + 2);
  prior.same_tissue = bytes.below(2) == 1;
  prior.radius = bytes.number(1e-6, 1e-1);
  prior.tip = from_bytes::one_of(bytes, static_cast<Tip*>(nullptr), from_bytes::MakeTip{});
  for (std::size_t k = 0, n = bytes.below(online::most_layers + 1); k < n; ++k)
    for (const auto& each : online::expected_limits)
      prior.layer[k].*each.member = expected(bytes, bytes.below(8) == 0 ? each.most : 1e-5 * each.most);
  if (bytes.below(2) == 0) return prior;
  prior.earlier.spacing = bytes.number(1e-9, 1.0);
  const double rise = bytes.number(-1e3, 1e3), scatter = bytes.number(0.0, 10.0);
  for (std::size_t i = 0; i < online::EarlierInsertions::points; ++i) {
    prior.earlier.mean[i] = rise * prior.earlier.spacing * double(i);
    prior.earlier.sd[i] = scatter;
  }
  return prior;
}

template <class Settings>
Settings settings_from(Bytes& bytes) {
  if (bytes.below(2) == 0) return {};
  const auto settings = from_bytes::numbers_of<Settings>(bytes);
  return first_invalid(settings) ? Settings{} : settings;
}

/// The same prior through the C face; nullptr where its tip has more than numbers.
nf_online* in_c(std::vector<double>& memory, const online::OnlinePrior& prior,
                const online::OnlineSettings& settings, const events::EventSettings& watched, bool refused) {
  const auto* cone = std::get_if<tips::Cone>(&prior.tip);
  if (!cone) return nullptr;
  const nf_tip tip{"cone", {{"half_angle", cone->half_angle}}, nullptr, nullptr, nullptr, 0};
  std::array<nf_layer_prior, online::most_layers> layers;
  std::memcpy(layers.data(), prior.layer.data(), sizeof layers);
  const nf_prior given{layers.data(),
                       layers.size(),
                       prior.layers,
                       prior.same_tissue,
                       prior.radius,
                       &tip,
                       prior.earlier.mean.data(),
                       prior.earlier.sd.data(),
                       prior.earlier.spacing};
  std::vector<nf_parameter> named;
  for (const auto& row : online::OnlineSettings::table) named.push_back({row.name, settings.*row.member});
  for (const auto& row : events::EventSettings::table) named.push_back({row.name, watched.*row.member});
  nf_fault why{};
  nf_online* made = nf_online_init(memory.data(), nf_online_size(), &given, named.data(), named.size(), &why);
  proof::require((made == nullptr) == (why.reason != nullptr), "a refusal has a reason");
  proof::require(prior.radius == 0.0 || (made == nullptr) == refused, "both faces refuse the same priors");
  return made;
}

/// A stream of which the bytes tell the next run.
class Stream {
 public:
  void run(proof::LearnTrial& trial, Bytes& bytes) {
    const double speed = 1e-3 * (double(bytes.below(16)) - 5.0) * (bytes.below(16) == 0 ? 100.0 : 1.0);
    const double rise = bytes.number(-50.0, 100.0), bend = bytes.number(-1e4, 1e5);
    const double before = depth_;
    for (std::size_t i = 0, n = 1 + bytes.below(128); i < n; ++i) {
      depth_ += speed * dt_;
      const double travel = depth_ - before;
      trial.step(force_ + rise * travel + bend * travel * travel + 1e-3 * double(i * 7 % 11), depth_, dt_);
    }
    const double travel = depth_ - before;
    force_ += rise * travel + bend * travel * travel;
  }
  void odd(proof::LearnTrial& trial, Bytes& bytes, std::size_t kind) {
    if (kind == 3) trial.step(bytes.number(-2.0, 2.0), depth_, dt_);
    if (kind == 4) trial.step(force_, bytes.number(-1e-2, 1e-2), dt_);
    if (kind == 5) trial.step(force_, depth_, bytes.number(0.0, 10.0));
    if (kind == 6) dt_ = 1e-4 * std::exp2(double(bytes.below(12)));
    if (kind == 7) force_ += 0.05 * double(std::int8_t(bytes.take<std::uint8_t>()));
    if (kind == 8) force_ *= bytes.below(8) == 0 ? 1e4 : 0.5;
    if (kind == 9) depth_ += bytes.number(-1.0, 1.0);
  }

 private:
  double force_ = 0.0, depth_ = 0.0, dt_ = 1e-2;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Bytes bytes(data, std::min<std::size_t>(size, 300));
  const auto settings = settings_from<online::OnlineSettings>(bytes);
  const auto watched = settings_from<events::EventSettings>(bytes);
  const online::OnlinePrior prior = bytes.below(2) == 0 ? online::OnlinePrior{} : prior_from(bytes);
  std::vector<double> memory(nf_online_size() / sizeof(double) + 1);
  const bool refused = flaw_of(prior).limit;
  nf_online* const c = in_c(memory, prior, settings, watched, refused);
  if (refused) return 0;
  const auto trial = std::make_unique<proof::LearnTrial>(prior, settings, watched, c);
  Stream stream;
  while (!bytes.empty()) {
    const std::size_t kind = bytes.below(20);
    if (kind == 0) trial->keep();
    if (kind == 1) trial->restore(bytes.take<std::uint16_t>(), bytes.take<std::uint32_t>());
    if (kind == 2) trial->reset();
    kind < 10 ? stream.odd(*trial, bytes, kind) : stream.run(*trial, bytes);
    if (kind == 1 || kind == 10) trial->look(bytes.number(-1.0, 1.0));
    if (kind > 16) trial->look(2e-3);
  }
  trial->look(2e-3);
  return 0;
}

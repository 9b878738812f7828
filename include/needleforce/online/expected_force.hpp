// SPDX-License-Identifier: Apache-2.0
// The force at a depth ahead, as a mixture of what each hypothesis expects of it.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "force_ahead.hpp"
#include "hypotheses.hpp"
#include "layered_force.hpp"
#include "online_settings.hpp"

namespace needleforce::online {

/// Where the needle is and the force there; whether the law holds now, whether the needle is outside of any
/// tissue, and whether neither is known. `size` is that of the force lately, also where it has just fallen.
struct Moment {
  double depth = 0.0, force = 0.0, mean_force = 0.0, size = 0.0, noise = 0.0;
  bool by_law = false, outside = false, unknown = false;
};
using Forces = Mixture<Hypotheses::most + 2>;

/// A view of what is known, for the time of one question. Allocates nothing.
class ExpectedForce {
 public:
  ExpectedForce(const OnlinePrior& prior, const OnlineSettings& settings, const LayeredForce& law,
                const Hypotheses& bank, const SlopeLately& lately, const NextPuncture& next,
                const Moment& now, double next_contact) noexcept
      : prior_(prior),
        settings_(settings),
        law_(law),
        bank_(bank),
        lately_(lately),
        next_(next),
        now_(now),
        means_(bank.means()),
        next_contact_(next_contact) {}

  Forces at(double depth) const noexcept {
    const double whole = cuts() ? 1.0 - next_.between(now_.depth, depth) : 1.0;
    Forces forces;
    for (std::size_t m = 0; m < bank_.count(); ++m) add(forces, whole * means_.weight[m], m, depth);
    if (now_.outside)
      add_contact(forces, std::abs(depth - now_.depth));
    else
      add_after_puncture(forces, 1.0 - whole, forces.mean());
    return forces;
  }

 private:
  bool cuts() const noexcept { return now_.by_law && !law_.outwards; }

  void add(Forces& forces, double weight, std::size_t m, double depth) const noexcept {
    const double noise = now_.noise;
    if (now_.outside) return forces.add(weight, 0.0, noise * noise);
    if (!now_.by_law) {
      const double walk = walks(std::abs(depth - now_.depth));
      return forces.add(weight, now_.force, walk * walk + noise * noise);
    }
    const bool no_contact = bank_[m].late && law_.pierced > 0 && law_.late_from == LayeredForce::nowhere;
    const double travel = depth - now_.depth;
    if (!no_contact || law_.outwards || !(travel > 0.0) || !law_.another(prior_))
      return add_by_law(forces, weight, m, depth, 0.0);
    const double begins = travel / (travel + 3e-3);
    add_by_law(forces, (1.0 - begins) * weight, m, depth, 0.0);
    add_by_law(forces, begins * weight, m, depth, 0.5 * next_contact_ * travel);
  }
  /// How far a force without a law may go [N]; of an unknown zero or sign as a contact that is a millimetre
  /// old.
  double walks(double travel) const noexcept {
    if (!now_.unknown) return now_.size * std::min(1.0, travel / 1e-3);
    const double grown = 1.0 + travel / 1e-3;
    return std::hypot(0.5 * now_.size * (grown * grown - 1.0), 1e5 * law_.contact().force(travel));
  }
  /// Parameters of one hypothesis, and of the residual now what is still correlated.
  void add_by_law(Forces& forces, double weight, std::size_t m, double depth, double more) const noexcept {
    const TissueEstimate& each = bank_[m];
    const Slots& theta = means_.theta[m];
    const double travel = std::abs(depth - now_.depth), noise = now_.noise;
    const double rho = each.kept(travel);
    const Slots there = by(depth, each.late), here = by(now_.depth, each.late);
    Slots apart{};
    double mean = rho * now_.mean_force + more;
    for (std::size_t i = 0; i < each.information.size(); ++i) {
      apart[i] = there[i] - rho * here[i];
      mean += apart[i] * theta[i];
    }
    const double size =
        std::hypot(noise, settings_.roughness * std::max(std::abs(mean), std::abs(now_.mean_force)));
    const double texture =
        each.scale * size * size * (1.0 - rho * rho) * (each.seen + 5.0) / (each.seen + 3.0);
    double law = mean * error_of_law(each, depth);
    if (lately_.known() && !law_.outwards && travel > 0.0) law = std::hypot(law, error_of_slope(m, travel));
    law = std::hypot(law, 2.0 * more);
    forces.add(weight, mean, each.information.variance(apart) + texture + law * law + noise * noise);
  }
  Slots by(double depth, bool late) const noexcept {
    Slots by = law_.by_parameters(prior_, depth);
    if (!late || law_.outwards) return by;
    const ContactSlots contact = law_.of_late_contact(prior_, depth);
    std::copy(contact.begin(), contact.end(), by.begin());
    return by;
  }
  /// Where the force does not grow as the law has it, it may continue as it did lately [N].
  double error_of_slope(std::size_t m, double travel) const noexcept {
    const double near = std::min(travel, 3e-4);
    double grows = 0.0;
    const Slots close = by(now_.depth + near, bank_[m].late), here = by(now_.depth, bank_[m].late);
    for (std::size_t i = 0; i < here.size(); ++i) grows += (close[i] - here[i]) * means_.theta[m][i];
    return (lately_.value() * near - grows) * std::min(travel, 2e-3) / near;
  }
  /// Share of the force by which a contact of unknown law may be off beyond what was seen: its exponent is
  /// known to 0.4 after a millimetre, and better with the root of what was seen.
  double error_of_law(const TissueEstimate& each, double depth) const noexcept {
    // recordings of the tissue were of this law, unless they are doubted
    const bool known = prior_.same_tissue && each.doubt < 2.0 && law_.top_known(prior_) &&
                       prior_.layer[std::min(law_.pierced, most_layers - 1)].modulus.known();
    if (law_.outwards || known) return 0.0;
    const double seen = std::max(now_.depth - law_.contact_since(), settings_.spacing);
    const double exponent = std::min(1.5, 0.4 * std::sqrt(1e-3 / seen));
    const double travel = std::max(depth - now_.depth, 0.0);
    return std::pow(1.0 + travel / seen, exponent) - 1.0;
  }
  /// Somewhere in this travel tissue may begin, of the prior's modulus or one of a soft tissue.
  void add_contact(Forces& forces, double travel) const noexcept {
    if (law_.outwards || !(travel > 0.0)) return;
    const Expected& prior = prior_.layer[0].modulus;
    const double force = (prior.known() ? prior.mean + prior.sd : 1e5) * law_.contact().force(0.5 * travel);
    forces.add(travel / (travel + 5e-3), force, force * force);
  }
  void add_after_puncture(Forces& forces, double weight, double before) const noexcept {
    const Expected& prior = prior_.layer[std::min(law_.pierced, most_layers - 1)].remainder;
    const Expected left = prior.known() ? prior : Expected{0.55, 0.25};
    const double spread = left.sd * before;
    forces.add(weight, left.mean * before, spread * spread);
  }

  const OnlinePrior& prior_;
  const OnlineSettings& settings_;
  const LayeredForce& law_;
  const Hypotheses& bank_;
  const SlopeLately& lately_;
  const NextPuncture next_;
  const Moment now_;
  const Hypotheses::Means means_;
  const double next_contact_;
};

}  // namespace needleforce::online

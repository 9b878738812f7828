// SPDX-License-Identifier: Apache-2.0
// Where the needle is in a MuJoCo model: a slide joint, or the site of its tip, and the tissue's surface.
#pragma once

#include <mujoco/mujoco.h>

#include <cmath>

#include "end_of_step.hpp"

namespace needleforce::mujoco {

/// A joint, or a site whose z axis is that of the insertion; the surface is a site whose z axis points out of
/// the tissue, or a height along a normal; for a joint a height alone, its position when the tip touches.
struct Place {
  int joint = -1, site = -1, surface = -1;
  double height = 0.0;
  double normal[3] = {0.0, 0.0, 1.0};

  int tree(const mjModel* m) const noexcept {
    return joint >= 0 ? m->dof_treeid[m->jnt_dofadr[joint]] : m->body_treeid[m->site_bodyid[site]];
  }
};

/// The axis z or x of a site in the world.
inline void axis_of(const mjData* d, int site, int column, double axis[3]) noexcept {
  for (int row = 0; row < 3; ++row) axis[row] = d->site_xmat[9 * site + 3 * row + column];
}

/// Distance of the tip above the surface [m], and the surface's outward normal.
inline double above(const Place& place, const mjData* d, double normal[3]) noexcept {
  const double* tip = d->site_xpos + 3 * place.site;
  if (place.surface < 0) {
    mju_copy3(normal, place.normal);
    return mju_dot3(normal, tip) - place.height;
  }
  axis_of(d, place.surface, 2, normal);
  const double* touched = d->site_xpos + 3 * place.surface;
  return mju_dot3(normal, tip) - mju_dot3(normal, touched);
}

/// How far 1 N along `pushed` moves what `felt` measures in a step [m/N], on a stack of 3 nv numbers.
inline double per_force(const mjModel* m, mjData* d, const double* felt, const double* pushed,
                        double* moved) {
  mj_solveM(m, d, moved, pushed, 1);
  return m->opt.timestep * m->opt.timestep * mju_dot(felt, moved, m->nv);
}

inline Free free_joint(const Place& place, const mjModel* m, mjData* d) {
  const int dof = m->jnt_dofadr[place.joint];
  const double depth = d->qpos[m->jnt_qposadr[place.joint]] - place.height;
  mj_markStack(d);
  double* unit = mj_stackAllocNum(d, m->nv);
  double* moved = mj_stackAllocNum(d, m->nv);
  mju_zero(unit, m->nv);
  unit[dof] = 1.0;
  const Free free{depth + m->opt.timestep * d->qvel[dof], per_force(m, d, unit, unit, moved), 0.0};
  mj_freeStack(d);
  return free;
}

/// A needle within 10 degrees of lying along the surface, or that points away, has no depth along its axis.
inline constexpr double min_inclination = 0.17;

/// Depth along the axis z = -(n.(tip - surface)) / (n.axis), and its rate with the axis turning. The depth of
/// an axis that does not point into the tissue is NaN, which the engine refuses: no force.
inline Free free_site(const Place& place, const mjModel* m, mjData* d) {
  double axis[3], normal[3], turned[3], moves[6];
  axis_of(d, place.site, 2, axis);
  const double height = above(place, d, normal);
  const double inwards = -mju_dot3(normal, axis);
  if (inwards < min_inclination) return {NAN, 0.0, 0.0};
  const double depth = -height / inwards;
  mj_objectVelocity(m, d, mjOBJ_SITE, place.site, moves, 0);
  mju_cross(turned, moves, axis);
  const double rate = (-mju_dot3(normal, moves + 3) + depth * mju_dot3(normal, turned)) / inwards;
  mj_markStack(d);
  double* jacobian = mj_stackAllocNum(d, 3 * m->nv);
  double* felt = mj_stackAllocNum(d, m->nv);
  double* pushed = mj_stackAllocNum(d, m->nv);
  double* moved = mj_stackAllocNum(d, m->nv);
  mj_jacSite(m, d, jacobian, nullptr, place.site);
  mju_mulMatTVec(felt, jacobian, normal, 3, m->nv);
  mju_scl(felt, felt, -1.0 / inwards, m->nv);
  mju_mulMatTVec(pushed, jacobian, axis, 3, m->nv);
  const double back = per_force(m, d, felt, pushed, moved);
  mj_freeStack(d);
  return {depth + m->opt.timestep * rate, back, 0.0};
}

inline Free free_motion(const Place& place, const mjModel* m, mjData* d) {
  return place.joint >= 0 ? free_joint(place, m, d) : free_site(place, m, d);
}

/// Adds the force of the tissue to the passive forces: against the joint, or at the tip against its axis and
/// across it along the site's x axis, the side of the bevel's point.
inline void apply(const Place& place, const Sample& sample, const mjModel* m, mjData* d) {
  if (place.joint >= 0) {
    d->qfrc_passive[m->jnt_dofadr[place.joint]] -= sample.force;
    return;
  }
  double axis[3], across[3], force[3];
  axis_of(d, place.site, 2, axis);
  axis_of(d, place.site, 0, across);
  for (int i = 0; i < 3; ++i) force[i] = sample.lateral * across[i] - sample.force * axis[i];
  mj_applyFT(m, d, force, nullptr, d->site_xpos + 3 * place.site, m->site_bodyid[place.site],
             d->qfrc_passive);
}

}  // namespace needleforce::mujoco

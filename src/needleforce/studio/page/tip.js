// SPDX-License-Identifier: Apache-2.0
// The tip of a needle as it is drawn: the profiles of the core's tips, which a test compares with Python's, and that of a
// model: of the tip that its law has, else of its needle with the half angle and radius that its law has.

const PLAIN = { radius: 0.35e-3, half_angle: 0.26 }; // of a model without a needle
const PIECES = 24;

const cot = (angle) => 1 / Math.tan(angle);

/** Height [m] above the apex at a radius [m], by the name of the tip. */
export const HEIGHTS = {
  cone: ({ half_angle }, r) => r * cot(half_angle),
  paraboloid: ({ radius }, r) => (r * r) / (2 * radius),
  sphere: ({ radius }, r) => radius - Math.sqrt(Math.max(0, radius * radius - r * r)),
  flat: () => 0,
  power_profile: (tip, r) => tip.reference_height * (r / tip.reference_radius) ** tip.exponent,
  truncated_cone: ({ half_angle, flat_radius }, r) => Math.max(0, r - flat_radius) * cot(half_angle),
  blunted_cone({ half_angle, tip_radius, transition_radius }, r) {
    const b = transition_radius || tip_radius * cot(half_angle);
    return r < b ? (r * r) / (2 * tip_radius) : (b * b) / (2 * tip_radius) + (r - b) * cot(half_angle);
  },
  tangent_ogive({ radius, length }, r) {
    const c = ((length - radius) * (length + radius)) / (2 * radius);
    return length - Math.sqrt(Math.max(0, (radius - r) * (radius + 2 * c + r)));
  },
  lancet_bevel: ({ half_angle }, r) => r * cot(half_angle),
  profile({ radii, heights }, r) {
    const next = radii.findIndex((one) => one >= r);
    if (next <= 0) return next ? heights.at(-1) : heights[0];
    const share = (r - radii[next - 1]) / (radii[next] - radii[next - 1]);
    return heights[next - 1] + share * (heights[next] - heights[next - 1]);
  },
};

/** Radius of the shaft [m] and the outline of the tip from left to right: [across, above the apex] [m]. */
export function tipOutline(law, needle) {
  const own = needle ?? PLAIN;
  const radius = (needle || law.tip ? law.radius : 0) || own.radius;
  const half_angle = (needle && law.half_angle) || own.half_angle || PLAIN.half_angle;
  const tip = law.tip ?? { name: "cone", half_angle };
  if (tip.name === "lancet_bevel") return { radius, points: [[-radius, 0], [radius, HEIGHTS.lancet_bevel(tip, 2 * radius)]] };
  const right = Array.from({ length: PIECES + 1 }, (_, i) => (radius * i) / PIECES).map((r) => [r, HEIGHTS[tip.name](tip, r)]);
  return { radius, points: [...right.slice(1).reverse().map(([r, height]) => [-r, height]), ...right] };
}

// SPDX-License-Identifier: Apache-2.0
// What is drawn over the depth of a steered needle: force along it, lateral force at its base, and how far its tip is off
// the axis; the plan as a dashed curve.

const sized = (a, b, length) => {
  const size = new Float64Array(length);
  for (let i = 0; i < length; ++i) size[i] = Math.hypot(a[i], b[i]);
  return size;
};

/** The quantities by the place of their plot: their label, factor, and values of a motion and of a plan. */
export const QUANTITIES = {
  "steer-force": {
    label: "axial force [N]", factor: 1, least: 0.1,
    of: ({ columns, length }) => columns.force.subarray(0, length), planned: (plan) => plan.force,
  },
  "steer-lateral": {
    label: "lateral force [N]", factor: 1, least: 0.05,
    of: ({ columns, length }) => sized(columns.fx, columns.fy, length),
    planned: (plan) => plan.wrench.map(([fx, fy]) => Math.hypot(fx, fy)),
  },
  "steer-deflection": {
    label: "tip off the axis [mm]", factor: 1e3, least: 1,
    of: ({ columns, length }) => sized(columns.tipX, columns.tipY, length),
    planned: (plan) => plan.path.map(([x, y]) => Math.hypot(x, y)),
  },
};

function range(label, least, lists, factor) {
  let [low, high] = [0, least];
  for (const list of lists)
    for (const value of list) {
      if (factor * value < low) low = factor * value;
      if (factor * value > high) high = factor * value;
    }
  return { label, low: low - 0.06 * (high - low), high: high + 0.1 * (high - low) };
}

/** The scene of plot.js of a quantity; `plan` or null. */
export function steeringScene({ motion, plan, from, high }, quantity, colour) {
  const { label, factor, least, of, planned } = quantity;
  const own = of(motion);
  const curves = [{ x: motion.columns.depth, y: own, length: own.length, scaleX: 1e3, scaleY: factor, colour: colour.a, width: 2.2 }];
  const lists = [own];
  if (plan) {
    const values = planned(plan);
    lists.push(values);
    curves.unshift({ x: plan.moves.map(([depth]) => depth), y: values, length: values.length, scaleX: 1e3, scaleY: factor,
      colour: colour.b, width: 1.8, dash: [6, 4] });
  }
  const last = own.length - 1;
  const here = Number.isFinite(own[last])
    ? [{ x: 1e3 * motion.columns.depth[last], y: factor * own[last], text: "", onLeft: false, colour: colour.a }] : [];
  return { x: { label: "depth [mm]", low: 1e3 * from, high: 1e3 * high }, y: range(label, least, lists, factor), curves, marks: here, cursor: null };
}

// SPDX-License-Identifier: Apache-2.0
// The tissue of a needle in a solid, drawn as it moves: what a unit force at each node of the path displaces, of which the
// package's finite elements made a table, times the forces of the needle. Along it they are those of the condensed solid
// in the core; across they are those that move the tissue's nodes as far as the needle is off its path.

const numbersOf = (text) => new Float32Array(Uint8Array.from(atob(text), (one) => one.charCodeAt(0)).buffer);

/** The needle that bends and, with it, the condensed solid along its axis, whose forces only that one gives. */
export class NeedleInSolid {
  constructor({ FlexibleInsertion, CondensedInsertion }, { solid, bending, settings }, layers) {
    this.bent = new FlexibleInsertion(layers, bending, settings);
    this.along = new CondensedInsertion(solid, layers, settings);
  }
  step(base, dt) {
    this.along.step(base.depth, null, dt);
    return this.bent.step(base, dt);
  }
  shape() {
    return this.bent.shape();
  }
  /** Forces of the needle on the nodes along it [N]. */
  forces() {
    return this.along.nodeForces();
  }
}

/** Linear between points that are in order of their last coordinate; null outside. */
function acrossAt(points, axis, depth) {
  const i = points.findIndex(([, , z]) => z >= depth);
  if (i < 0) return null;
  if (i === 0) return points[0][axis];
  const [a, b] = [points[i - 1], points[i]];
  const share = (depth - a[2]) / (b[2] - a[2] || 1);
  return a[axis] + share * (b[axis] - a[axis]);
}

/** Solves symmetric equations by elimination. */
function solved(matrix, right) {
  const rows = matrix.map((row, i) => [...row, right[i]]);
  const n = rows.length;
  for (let k = 0; k < n; ++k)
    for (let i = k + 1; i < n; ++i) {
      const factor = rows[i][k] / rows[k][k];
      for (let j = k; j <= n; ++j) rows[i][j] -= factor * rows[k][j];
    }
  for (let i = n - 1; i >= 0; --i) {
    for (let j = i + 1; j < n; ++j) rows[i][n] -= rows[i][j] * rows[j][n];
    rows[i][n] /= rows[i][i];
  }
  return rows.map((row) => row[n]);
}

export class SolidField {
  constructor({ field, solid }) {
    const { along, aside } = field;
    Object.assign(this, field, { spacing: solid.spacing, along: numbersOf(along), aside: numbersOf(aside) });
  }
  /** Forces across on the tissue at the nodes [N], as far as the needle is in it. */
  forcesAcross(shape, path, axis) {
    const offsets = [];
    for (let z = 0; offsets.length < this.compliance.length; z += this.spacing) {
      const [needle, cut] = [acrossAt(shape, axis, z), acrossAt(path, axis, z)];
      if (needle === null || cut === null) break;
      offsets.push(needle - cut);
    }
    const inside = this.compliance.slice(0, offsets.length).map((row) => row.slice(0, offsets.length));
    return solved(inside, offsets);
  }
  /** Displacement [across, down] of the places for forces at the nodes, one after the other, row by row. */
  #sum(table, forces) {
    const size = 2 * this.across.length * this.down.length;
    const total = new Float64Array(size);
    forces.forEach((force, k) => {
      if (force) for (let i = 0; i < size; ++i) total[i] += force * table[k * size + i];
    });
    return total;
  }
  /** Rows of places from left to right, each [across, depth, how far it moved], all in m. */
  places(along, aside) {
    const [u, v] = [this.#sum(this.along, along), this.#sum(this.aside, aside)];
    const columns = this.across.length;
    // seen in the mirror, a force along the needle moves tissue the same way down, one across it the opposite way
    const place = (row, column, side) => {
      const i = 2 * (row * columns + column);
      const [x, z] = [side * u[i] + v[i], u[i + 1] + side * v[i + 1]];
      return [side * this.across[column] + x, this.down[row] + z, Math.hypot(x, z)];
    };
    return this.down.map((_, row) => [
      ...this.across.map((_, column) => place(row, column, -1)).slice(1).reverse(),
      ...this.across.map((_, column) => place(row, column, 1)),
    ]);
  }
}

/** Draws places in a view: the cells darker the further they moved, and the lines of the mesh. */
export function drawPlaces(context, colour, at, rows) {
  const most = Math.max(1e-4, ...rows.flatMap((row) => row.map(([, , moved]) => moved)));
  const pixel = ([x, z]) => [at.x(x), at.y(z)];
  const shape = (points, closed) => {
    context.beginPath();
    points.forEach((point, i) => (i ? context.lineTo(...pixel(point)) : context.moveTo(...pixel(point))));
    if (closed) context.closePath();
  };
  const edge = [...rows[0], ...rows.map((row) => row.at(-1)), ...rows.at(-1).toReversed(), ...rows.map((row) => row[0]).reverse()];
  shape(edge, true);
  context.fillStyle = colour.tissue;
  context.fill();
  context.fillStyle = colour.a;
  for (let i = 1; i < rows.length; ++i)
    for (let j = 1; j < rows[i].length; ++j) {
      const cell = [rows[i - 1][j - 1], rows[i - 1][j], rows[i][j], rows[i][j - 1]];
      const moved = cell.reduce((sum, [, , one]) => sum + one, 0) / (4 * most);
      if (moved < 0.02) continue;
      shape(cell, true);
      context.globalAlpha = 0.55 * moved;
      context.fill();
    }
  context.globalAlpha = 0.45;
  context.strokeStyle = colour.cut;
  context.lineWidth = 0.8;
  for (const row of rows) { shape(row, false); context.stroke(); }
  rows[0].forEach((_, j) => { shape(rows.map((row) => row[j]), false); context.stroke(); });
  context.globalAlpha = 1;
  return most;
}

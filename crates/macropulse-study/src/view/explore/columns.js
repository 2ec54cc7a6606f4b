// Columns of a cloud, unpacked as packed.rs packed them.

async function inflated(base64) {
  const text = atob(base64);
  const deflated = new Uint8Array(text.length);
  for (let at = 0; at < text.length; at += 1) deflated[at] = text.charCodeAt(at);
  const stream = new Blob([deflated]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// The values of a packed column, NaN where there is none.
async function unpacked(column, points) {
  const planes = await inflated(column.deflated);
  const codes = new Int32Array(points);
  let code = 0;
  let highest = 0;
  for (let at = 0; at < points; at += 1) {
    let folded = 0;
    for (let byte = column.bytes - 1; byte >= 0; byte -= 1) {
      folded = folded * 256 + planes[byte * points + at];
    }
    code += folded % 2 ? -(folded + 1) / 2 : folded / 2;
    codes[at] = code;
    if (code > highest) highest = code;
  }
  // Single precision where it tells all steps apart.
  const most = Math.max(Math.abs(column.low), Math.abs(column.low + highest * column.step));
  const Numbers = most / column.step < 2 ** 23 ? Float32Array : Float64Array;
  const values = new Numbers(points);
  for (let at = 0; at < points; at += 1) {
    values[at] = codes[at] === 0 ? NaN : column.low + (codes[at] - 1) * column.step;
  }
  return values;
}

// A cloud as the rest of the page wants it: its columns by name, and for each pixel the return that
// its image shows, -1 without one.
async function cloudOf(packed) {
  const cloud = { ...packed, values: {}, units: {}, steps: {} };
  for (const column of packed.attributes) {
    cloud.values[column.name] = await unpacked(column, packed.points);
    cloud.units[column.name] = column.unit;
    cloud.steps[column.name] = column.step;
  }
  const { row, column, shown } = cloud.values;
  cloud.image = new Int32Array(packed.rows * packed.columns).fill(-1);
  for (let at = 0; row && at < packed.points; at += 1) {
    if (!shown || shown[at] === 1) cloud.image[row[at] * packed.columns + column[at]] = at;
  }
  cloud.outcomes = packed.pixels ? await inflated(packed.pixels) : null;
  return cloud;
}

// The values at these shares of all, from 0 to 1, of a column; those that are none do not count.
function percentiles(values, shares) {
  const sorted = values.filter((value) => !Number.isNaN(value)).sort();
  if (sorted.length === 0) return shares.map(() => NaN);
  return shares.map((share) => sorted[Math.round(share * (sorted.length - 1))]);
}

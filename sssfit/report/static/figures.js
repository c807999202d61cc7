// Figures of an error over the pixels that count: mean, percentiles, histogram, the worst places.

// As numpy.percentile does: linear between the two nearest of sorted values.
export function percentile(sorted, percent) {
  const at = (sorted.length - 1) * percent / 100, k = Math.floor(at);
  return sorted[k] + (at - k) * (sorted[Math.min(k + 1, sorted.length - 1)] - sorted[k]);
}

export function figuresOf(errors, mask) {
  const counted = Float64Array.from(errors.filter((_, k) => mask[k] > 0)).sort();
  const mean = counted.reduce((sum, each) => sum + each, 0) / counted.length;
  return { mean, p95: percentile(counted, 95), p99: percentile(counted, 99), sorted: counted };
}

// Bins of Delta E, each as high as the error that its pixels have together; a few large errors then
// show beside many small ones. Quartiles are of the same weight.
export function histogramOf(sorted, end, count) {
  const bins = new Array(count).fill(0), total = sorted.reduce((sum, each) => sum + each, 0);
  const quartiles = [];
  let sum = 0;
  for (const each of sorted) {
    bins[Math.min(Math.floor(each / end * count), count - 1)] += total > 0 ? each / total : 0;
    sum += each;
    while (quartiles.length < 3 && total > 0 && sum >= total * (quartiles.length + 1) / 4) quartiles.push(each);
  }
  return { bins, quartiles };
}

// The pixels with the largest errors, at least `apart` from each other.
export function worstOf(errors, mask, width, count, apart) {
  const found = [];
  const order = [...errors.keys()].filter((k) => mask[k] > 0 && errors[k] > 0);
  order.sort((a, b) => errors[b] - errors[a]);
  for (const k of order) {
    const place = { x: k % width, y: Math.floor(k / width), error: errors[k] };
    if (found.every(({ x, y }) => Math.hypot(x - place.x, y - place.y) >= apart)) found.push(place);
    if (found.length === count) break;
  }
  return found;
}

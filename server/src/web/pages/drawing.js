// The picture: tiles of the grid, rooms, the way, the robot. Metres in the map, y upwards.

const SCALES = [0.5, 400]; // pixels a metre
const LABEL_MIN = 0.3;
/** Soft colours that the colour-blind tell apart (after Okabe and Ito). */
const ROOMS = ["#56b4e9", "#e69f00", "#009e73", "#cc79a7", "#f0e442", "#0072b2", "#d55e00", "#999999"];

const colour = (id) => ROOMS[id % ROOMS.length];

export function inside([x, y], polygon) {
  let is = false;
  for (let i = 0, j = polygon.length - 1; i < polygon.length; j = i++) {
    const [[xi, yi], [xj, yj]] = [polygon[i], polygon[j]];
    if (yi > y !== yj > y && x < ((xj - xi) * (y - yi)) / (yj - yi) + xi) is = !is;
  }
  return is;
}

function toEdge([x, y], polygon) {
  let nearest = Infinity;
  for (let i = 0, j = polygon.length - 1; i < polygon.length; j = i++) {
    const [[ax, ay], [bx, by]] = [polygon[j], polygon[i]];
    const [dx, dy] = [bx - ax, by - ay];
    const t = Math.max(0, Math.min(1, ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy || 1)));
    nearest = Math.min(nearest, Math.hypot(ax + t * dx - x, ay + t * dy - y));
  }
  return nearest;
}

/** A point well within an outline: where its name stands. */
export function middle(polygon) {
  const [xs, ys] = [polygon.map((p) => p[0]), polygon.map((p) => p[1])];
  const [left, right, low, high] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
  let [best, room] = [[(left + right) / 2, (low + high) / 2], -1];
  const N = 14;
  for (let i = 1; i < N; i++) {
    for (let j = 1; j < N; j++) {
      const p = [left + ((right - left) * i) / N, low + ((high - low) * j) / N];
      const free = inside(p, polygon) ? toEdge(p, polygon) : -1;
      if (free > room) [best, room] = [p, free];
    }
  }
  return best;
}

export class Drawing {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.tiles = new Map();
    this.regions = [];
    this.areas = [];
    this.graph = null;
    /** Where the robot was since the graph was fetched. */
    this.trail = [];
    this.robots = new Map();
    this.found = [];
    this.chosen = null;
    this.doubt = false;
    this.centre = [0, 0];
    this.scale = 20;
    this.wanted = false;
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.recolour());
    this.resize();
  }

  resize() {
    const ratio = devicePixelRatio || 1;
    const { width, height } = this.canvas.parentElement.getBoundingClientRect();
    Object.assign(this.canvas, { width: Math.round(width * ratio), height: Math.round(height * ratio) });
    this.ratio = ratio;
    this.draw();
  }

  /** Draws before the next frame, however often it is asked for. */
  draw() {
    if (this.wanted) return;
    this.wanted = true;
    requestAnimationFrame(() => {
      this.wanted = false;
      this.drawNow();
    });
  }

  style(name) {
    return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  }

  /** Takes a list of tiles; fetches those that have changed. `load` gives the picture of one. */
  async take({ resolution_m, tile_cells, tiles }, load) {
    const known = new Set(tiles.map(({ x, y }) => `${x},${y}`));
    for (const key of this.tiles.keys()) if (!known.has(key)) this.tiles.delete(key);
    this.edge_m = resolution_m * tile_cells;
    await Promise.all(tiles.map(async ({ x, y, hash }) => {
      const key = `${x},${y}`;
      if (this.tiles.get(key)?.hash === hash) return;
      const bitmap = await load(x, y, hash);
      this.tiles.set(key, { x, y, hash, bitmap, shown: this.coloured(bitmap) });
      this.draw();
    }));
    this.draw();
  }

  /** Shades of a grid in the page's colours: walls, floor, nothing. */
  coloured(bitmap) {
    const shown = new OffscreenCanvas(bitmap.width, bitmap.height);
    const context = shown.getContext("2d");
    context.drawImage(bitmap, 0, 0);
    const pixels = context.getImageData(0, 0, bitmap.width, bitmap.height);
    const [wall, floor] = ["--wall", "--floor"].map((name) =>
      this.style(name).match(/[0-9a-f]{2}/gi).map((part) => parseInt(part, 16)));
    const { data } = pixels;
    for (let k = 0; k < data.length; k += 4) {
      const free = data[k] / 255;
      for (let c = 0; c < 3; c++) data[k + c] = wall[c] + (floor[c] - wall[c]) * free;
    }
    context.putImageData(pixels, 0, 0);
    return shown;
  }

  recolour() {
    for (const tile of this.tiles.values()) tile.shown = this.coloured(tile.bitmap);
    this.draw();
  }

  setRegions(regions, areas = []) {
    this.areas = areas;
    const known = new Map(this.regions.map((r) => [JSON.stringify(r.polygon_m), r.middle]));
    this.regions = regions.map((r) => ({ ...r, middle: known.get(JSON.stringify(r.polygon_m)) ?? middle(r.polygon_m) }));
    this.draw();
  }

  toScreen([x, y]) {
    const { width, height } = this.canvas;
    const scale = this.scale * this.ratio;
    return [width / 2 + (x - this.centre[0]) * scale, height / 2 - (y - this.centre[1]) * scale];
  }

  toMap(x, y) {
    const { width, height } = this.canvas.getBoundingClientRect();
    return [this.centre[0] + (x - width / 2) / this.scale, this.centre[1] - (y - height / 2) / this.scale];
  }

  pan(dx, dy) {
    this.centre = [this.centre[0] - dx / this.scale, this.centre[1] + dy / this.scale];
    this.draw();
  }

  /** Zooms round a point of the screen. */
  zoom(factor, x, y) {
    const box = this.canvas.getBoundingClientRect();
    [x, y] = [x ?? box.width / 2, y ?? box.height / 2];
    const before = this.toMap(x, y);
    this.scale = Math.max(SCALES[0], Math.min(SCALES[1], this.scale * factor));
    const after = this.toMap(x, y);
    this.centre = [this.centre[0] + before[0] - after[0], this.centre[1] + before[1] - after[1]];
    this.draw();
  }

  /** Moves there, and shows so many metres around. */
  fly(to, around_m) {
    const box = this.canvas.getBoundingClientRect();
    const scale = around_m ? Math.min(SCALES[1], Math.min(box.width, box.height) / (2 * around_m)) : this.scale;
    const [from, old, start] = [this.centre, this.scale, performance.now()];
    const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    const step = (now) => {
      const t = still ? 1 : Math.min(1, (now - start) / 400);
      const s = t * t * (3 - 2 * t);
      this.centre = [from[0] + (to[0] - from[0]) * s, from[1] + (to[1] - from[1]) * s];
      this.scale = old * (scale / old) ** s;
      this.drawNow();
      if (t < 1) requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }

  /** Shows all of it. */
  fit() {
    const tiles = [...this.tiles.values()];
    const points = this.regions.flatMap((r) => r.polygon_m);
    const corners = points.length ? points : tiles.flatMap(({ x, y }) =>
      [[x, y], [x + 1, y + 1]].map((p) => p.map((k) => k * this.edge_m)));
    if (!corners.length) return;
    const [xs, ys] = [corners.map((p) => p[0]), corners.map((p) => p[1])];
    const [left, right, low, high] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
    const box = this.canvas.getBoundingClientRect();
    this.scale = Math.max(SCALES[0], Math.min(60, 0.92 * Math.min(box.width / (right - left || 1), box.height / (high - low || 1))));
    this.centre = [(left + right) / 2, (low + high) / 2];
    this.draw();
  }

  regionAt(point) {
    return this.regions.find((r) => inside(point, r.polygon_m) && !r.holes_m.some((hole) => inside(point, hole)));
  }

  path(points, close) {
    const c = this.context;
    points.forEach((p, k) => (k ? c.lineTo(...this.toScreen(p)) : c.moveTo(...this.toScreen(p))));
    if (close) c.closePath();
  }

  drawNow() {
    const c = this.context;
    const px = this.ratio;
    c.setTransform(1, 0, 0, 1, 0, 0);
    c.fillStyle = this.style("--unknown");
    c.fillRect(0, 0, this.canvas.width, this.canvas.height);
    c.imageSmoothingEnabled = this.scale < 10;
    for (const { x, y, shown } of this.tiles.values()) {
      const [left, top] = this.toScreen([x * this.edge_m, (y + 1) * this.edge_m]);
      const size = this.edge_m * this.scale * px;
      if (left > this.canvas.width || top > this.canvas.height || left + size < 0 || top + size < 0) continue;
      // To whole pixels, or seams show.
      const [l, t] = [Math.floor(left), Math.floor(top)];
      c.drawImage(shown, l, t, Math.ceil(left + size) - l, Math.ceil(top + size) - t);
    }
    for (const r of this.regions) {
      c.beginPath();
      this.path(r.polygon_m, true);
      for (const hole of r.holes_m) this.path(hole, true);
      const chosen = this.chosen === r.id || this.found.some((f) => f.region === r.id);
      c.globalAlpha = chosen ? 0.5 : 0.22;
      c.fillStyle = colour(r.id);
      c.fill("evenodd");
      c.globalAlpha = 1;
      if (chosen) {
        c.lineWidth = 3 * px;
        c.strokeStyle = this.style("--strong");
        c.stroke();
      }
    }
    for (const area of this.areas) {
      c.beginPath();
      this.path(area.polygon_m, true);
      c.lineWidth = 2 * px;
      c.strokeStyle = c.fillStyle = this.style(area.forbidden ? "--bad" : "--soft");
      if (area.forbidden) {
        c.globalAlpha = 0.25;
        c.fill("evenodd");
        c.globalAlpha = 1;
      }
      c.setLineDash([8 * px, 5 * px]);
      c.stroke();
      c.setLineDash([]);
    }
    this.drawGraph(c, px);
    this.drawLabels();
    for (const f of this.found) this.flag([f.x_m, f.y_m], `${Math.round(100 * f.probability)} %`);
    for (const pose of this.robots.values()) this.robot(pose);
  }

  drawGraph(c, px) {
    if (!this.graph) return;
    const at = new Map(this.graph.places.map((p) => [p.id, [p.x_m, p.y_m]]));
    c.lineWidth = 1.5 * px;
    c.strokeStyle = this.style("--way");
    c.beginPath();
    this.path([...at.values(), ...this.trail]);
    c.stroke();
    if (!this.doubt) return;
    for (const [k, particle] of this.graph.particles.slice(0, 3).entries()) {
      c.strokeStyle = ["#d55e00", "#0072b2", "#cc79a7"][k];
      c.setLineDash(k ? [6 * px, 4 * px] : []);
      c.beginPath();
      for (const e of particle.edges) if (at.has(e.i) && at.has(e.j)) this.path([at.get(e.i), at.get(e.j)]);
      c.stroke();
    }
    c.setLineDash([]);
  }

  /** Names, the surest and largest first; those that find no room wait until one comes closer. */
  drawLabels() {
    const c = this.context;
    const size = 13 * this.ratio;
    const placed = [];
    const named = this.regions.filter((r) => r.names[0]?.p >= LABEL_MIN);
    named.sort((a, b) => (b.id === this.chosen) - (a.id === this.chosen) || b.names[0].p * b.area_m2 - a.names[0].p * a.area_m2);
    for (const { middle: at, names: [name] } of named) {
      c.font = `600 ${size}px system-ui, sans-serif`;
      const [x, y] = this.toScreen(at);
      const half = c.measureText(name.label).width / 2 + 3 * this.ratio;
      const box = [x - half, y - 0.7 * size, x + half, y + (name.p < 0.8 ? 1.6 : 0.7) * size];
      if (placed.some((o) => box[0] < o[2] && o[0] < box[2] && box[1] < o[3] && o[1] < box[3])) continue;
      placed.push(box);
      this.label(at, name.label, name.p < 0.8 ? `${Math.round(100 * name.p)} %` : "");
    }
  }

  label(point, text, sure) {
    const c = this.context;
    const [x, y] = this.toScreen(point);
    const size = 13 * this.ratio;
    c.font = `600 ${size}px system-ui, sans-serif`;
    c.textAlign = "center";
    c.textBaseline = "middle";
    c.lineJoin = "round";
    c.lineWidth = 4 * this.ratio;
    c.strokeStyle = this.style("--halo");
    c.fillStyle = this.style("--strong");
    c.strokeText(text, x, y);
    c.fillText(text, x, y);
    if (!sure) return;
    c.font = `${0.8 * size}px system-ui, sans-serif`;
    c.strokeText(sure, x, y + size);
    c.fillText(sure, x, y + size);
  }

  flag(point, text) {
    const c = this.context;
    const px = this.ratio;
    const [x, y] = this.toScreen(point);
    c.beginPath();
    c.arc(x, y, 9 * px, 0, 2 * Math.PI);
    c.fillStyle = "#d55e00";
    c.fill();
    c.lineWidth = 2 * px;
    c.strokeStyle = "#fff";
    c.stroke();
    this.label([point[0], point[1] - 20 / this.scale], text, "");
  }

  robot({ map_from_body: { x_m, y_m, yaw_rad }, state }) {
    const c = this.context;
    const px = this.ratio;
    const [x, y] = this.toScreen([x_m, y_m]);
    c.save();
    c.translate(x, y);
    c.rotate(-yaw_rad);
    c.beginPath();
    c.moveTo(14 * px, 0);
    c.lineTo(-9 * px, 9 * px);
    c.lineTo(-5 * px, 0);
    c.lineTo(-9 * px, -9 * px);
    c.closePath();
    c.fillStyle = state === "lost" || state === "doubtful" ? "#e69f00" : this.style("--accent");
    c.fill();
    c.lineWidth = 2 * px;
    c.strokeStyle = "#fff";
    c.stroke();
    c.restore();
  }
}

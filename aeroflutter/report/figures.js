"use strict";
// The figures of a report, from `data`, which is all there is to show. One script with page.js.

const METHODS = { df: "describing function", hb: "harmonic balance", exact: "exact" };
const SYMBOLS = {
  fold: "circle", corner: "triangle-down", "symmetry-breaking": "square",
  "period-doubling": "diamond", "neimark-sacker": "star", grazing: "x-thin-open",
};
const CONFIG = { responsive: true, displayModeBar: false };
const COARSE = window.matchMedia("(pointer: coarse)").matches; // a finger scrolls, it does not zoom
const FONT = getComputedStyle(document.body).fontFamily;

const byId = (id) => document.getElementById(id);
const data = JSON.parse(byId("data").textContent);
const toPage = data.map ? data.map.x.scale : 1; // from the map's speeds to those of the page
let chosen = null; // the cell, point or bifurcation whose motion is shown

// ---------------------------------------------------------------- colours and layouts

const colours = new Map(); // of the theme at hand: asking the page makes it lay itself out anew

/** A property of the page's style as a colour that plotly understands. */
function colour(name) {
  if (!colours.has(name)) {
    const probe = byId("problem");
    probe.style.color = `var(--${name})`;
    colours.set(name, getComputedStyle(probe).color);
    probe.style.color = "";
  }
  return colours.get(name);
}

function axis(title, more = {}) {
  return { title: { text: title, standoff: 6, font: { size: 13 } }, gridcolor: colour("grid"),
    zerolinecolor: colour("rule"), linecolor: colour("rule"), ...more };
}

function draw(id, traces, x, y, more = {}) {
  const layout = {
    paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
    font: { color: colour("ink"), size: 12, family: FONT },
    margin: { l: 52, r: 12, t: 30, b: 44 }, hovermode: "closest",
    dragmode: COARSE ? false : "zoom", showlegend: false,
    hoverlabel: { bgcolor: colour("panel"), bordercolor: colour("rule"),
      font: { color: colour("ink") }, align: "left" },
    legend: { orientation: "h", x: 0, y: 1.02, yanchor: "bottom", font: { size: 12 } },
    xaxis: x, yaxis: { automargin: true, ...y }, ...more,
  };
  return Plotly.react(id, traces, layout, CONFIG);
}

const heading = (text) => ({ margin: { l: 52, r: 12, t: 40, b: 44 },
  title: { text, font: { size: 14 }, x: 0.02, xanchor: "left", yref: "container", y: 0.98, yanchor: "top" } });
const html = (text) => text.replace("U*_L", "U*<sub>L</sub>").replace("ω_α", "ω<sub>α</sub>");
const number = (value, digits = 5) =>
  value === null || !Number.isFinite(value) ? "–" : String(+value.toPrecision(digits));

// In the unit of the coordinate of the first spring; where motions start has one of its own.
const { unit: NAME, mark: MARK, effort: EFFORT } = data.told;
const SPEED = data.axis.key === "velocity" ? " m/s" : ""; // behind an airspeed
const told = (value, digits = 5) => number(value, digits) + MARK;
const COORDINATE = `${data.coordinate} (${NAME})`;
const RESTORING = `restoring ${EFFORT} (${NAME})`;
const AMPLITUDE = `${data.coordinate} amplitude (${NAME})`;

function speedLine(speed, name) {
  return [
    { type: "line", x0: speed, x1: speed, yref: "paper", y0: 0, y1: 1,
      line: { color: colour("faint"), width: 1, dash: "dot" } },
    { x: speed, yref: "paper", y: 1, text: name, showarrow: false, textangle: -90,
      xanchor: "right", yanchor: "top", font: { size: 11, color: colour("faint") } },
  ];
}

function marks(pairs) {
  const lines = pairs.filter(([speed]) => speed !== null).map((pair) => speedLine(...pair));
  return { shapes: lines.map((one) => one[0]), annotations: lines.map((one) => one[1]) };
}

// ---------------------------------------------------------------- section and linear flutter

const MODES = 5; // colours of modes, which come round again

let linearAt = null; // index of the airspeed whose roots are read out

/** Frequency and damping of every mode at one airspeed, in words. */
function linearWords(n) {
  const { speeds, speed, frequency, modes } = data.locus;
  const each = modes.map((mode, i) => (mode.frequency[n] === null ? `mode ${i + 1} does not oscillate`
    : `mode ${i + 1} ${frequency} ${number(mode.frequency[n], 4)}, damping ratio ${number(mode.damping[n], 3)}`));
  return `${speed} ${number(speeds[n], 4)}: ${each.join("; ")}.`;
}

function drawSpring() {
  const { pitch, moment } = data.spring;
  draw("plot-spring", [{ x: pitch, y: moment, mode: "lines",
    line: { color: colour("ink"), width: 2 },
    hovertemplate: `%{x:.4g}${MARK}<br>${EFFORT} %{y:.4g}${MARK}<extra></extra>` }],
    axis(COORDINATE), axis(RESTORING), heading("spring"));
}

function drawLocus() {
  const { speeds, modes, crossings, flutter, divergence, speed, frequency } = data.locus;
  const hertz = html(frequency);
  const each = (x, y, template) => modes.map((mode, n) => ({
    x: typeof x === "string" ? mode[x] : x, y: mode[y], mode: "lines", name: `mode ${n + 1}`,
    customdata: speeds, line: { color: colour(`line-mode-${n % MODES}`), width: 2 },
    hovertemplate: template }));
  const growing = crossings.filter((one) => one.growing);
  const top = flutter === null ? undefined : 3 * growing[0].k;
  const seen = modes.flatMap((mode) => mode.re.filter((re, i) =>
    re !== null && (top === undefined || mode.im[i] < top)));
  const [low, high] = [Math.min(...seen, 0), Math.max(...seen, 0)];
  const pad = 0.12 * (high - low || 1);
  draw("plot-locus", [
    ...each("re", "im", `${speed} %{customdata:.5g}<br>Re p = %{x:.4g}<br>Im p = %{y:.4g}`),
    { x: growing.map(() => 0), y: growing.map((one) => one.k), mode: "markers", name: "flutter",
      customdata: growing.map((one) => one.speed),
      marker: { symbol: "x", size: 9, color: colour("ink") },
      hovertemplate: `${speed} %{customdata:.6g}<br>k = %{y:.5g}` },
  ], axis(data.axis.seconds ? "Re p (1/s)" : "Re p, p over V/b", { range: [low - pad, high + pad] }),
  axis(data.axis.seconds ? "Im p (1/s)" : "Im p", top ? { range: [0, top] } : { rangemode: "tozero" }), heading("root locus"));
  const shown = marks([[flutter, "flutter"],
    [divergence !== null && divergence < Math.max(...speeds) ? divergence : null, "divergence"],
    ...(linearAt === null ? [] : [[speeds[linearAt], ""]])]);
  draw("plot-frequency", each(speeds, "frequency", `${speed} %{x:.5g}<br>${hertz} %{y:.5g}`),
    axis(speed), axis(hertz, { rangemode: "tozero" }),
    { ...heading("frequency"), ...shown, showlegend: modes.length <= 8,
      legend: { orientation: "h", x: 1, xanchor: "right", y: 1.02, yanchor: "bottom", font: { size: 11 } } });
  draw("plot-damping", each(speeds, "damping", `${speed} %{x:.5g}<br>damping %{y:.4g}`),
    axis(speed), axis("damping ratio"), { ...heading("damping"), ...shown });
}

// ---------------------------------------------------------------- limit cycles

const WIDTHS = { df: 5, hb: 3, exact: 1.6 };

/** The curve twice, stable and unstable points; neighbours are kept, so that lines join up. */
function halves(curve, n) {
  return [true, false].map((wanted) => {
    const mine = curve.stable.map((stable, i) => stable === wanted ||
      (wanted === false && [i - 1, i + 1].some((j) => curve.stable[j] === wanted)));
    return { x: curve.x, y: curve.amplitude.map((value, i) => (mine[i] ? value : null)),
      mode: "lines", name: METHODS[curve.method], legendgroup: curve.method,
      showlegend: wanted && data.curves.findIndex((one) => one.method === curve.method) === n,
      customdata: curve.x.map((x, i) => [n, i, periodWords(curve.period[i], x), curve.bias[i], band(curve, i),
        curve.stable[i] ? "stable" : "unstable"]),
      line: { color: colour(`line-${curve.method}`), width: WIDTHS[curve.method],
        dash: wanted ? "solid" : "dash" },
      opacity: curve.method === "exact" ? 1 : 0.75,
      hovertemplate: `${METHODS[curve.method]}, %{customdata[5]}<br>` +
        `speed %{x:.6g}${SPEED}<br>amplitude %{y:.5g}${MARK}<br>bias %{customdata[3]:.4g}${MARK}<br>` +
        "%{customdata[2]}%{customdata[4]}<extra></extra>" };
  }).filter((trace) => trace.y.some((value) => value !== null) || trace.showlegend);
}

function band(curve, i) {
  const found = curve.band && curve.band[i];
  if (!found || found[0] === null) return "";
  return `<br>proved: speed within ${number(found[0], 6)} to ${number(found[1], 6)}`;
}

function outlines() {
  return data.curves.filter((curve) => curve.outline && curve.outline.x.length).map((curve, n) => ({
    x: curve.outline.x, y: curve.outline.y, mode: "lines", fill: "toself", hoverinfo: "skip",
    fillcolor: colour("shade-proved"), line: { width: 0 }, name: "proved band", legendgroup: "band",
    showlegend: n === 0 }));
}

function bifurcations() {
  return Object.keys(SYMBOLS).map((kind) => {
    const found = data.events.map((event, n) => ({ ...event, n })).filter((e) => e.kind === kind);
    return { x: found.map((e) => e.x), y: found.map((e) => e.amplitude), mode: "markers", name: kind,
      customdata: found.map((e) => [-1, e.n, periodWords(e.period, e.x)]),
      marker: { symbol: SYMBOLS[kind], size: 9, color: colour("ink"),
        line: { color: colour("paper"), width: kind === "grazing" ? 2 : 1 } },
      hovertemplate: `${kind}<br>speed %{x:.7g}${SPEED}<br>amplitude %{y:.5g}${MARK}<br>` +
        "%{customdata[2]}<extra></extra>" };
  }).filter((trace) => trace.x.length);
}

/** These digits in every decade. */
const decades = (low, high, digits) => Array.from({ length: high - low + 1 }, (_, i) =>
  digits.map((digit) => digit * 10 ** (low + i))).flat();

/** The axis of amplitudes, logarithmic where the curves would crowd at its foot. */
function amplitudes() {
  const { y, log } = data.view;
  if (!y) return axis(AMPLITUDE);
  if (!log) return axis(AMPLITUDE, { range: y });
  const ticks = decades(Math.floor(Math.log10(y[0])), Math.ceil(Math.log10(y[1])), [1, 2, 5]);
  return axis(AMPLITUDE, { type: "log", range: y.map(Math.log10),
    tickvals: ticks, ticktext: ticks.map((value) => number(value, 2)) });
}

function drawCurves() {
  const traces = [...outlines(), ...data.curves.flatMap(halves), ...bifurcations()];
  draw("plot-curves", traces, axis(html(data.axis.label), { range: data.view.x || undefined }),
    amplitudes(),
    { showlegend: true, margin: { l: 52, r: 12, t: 10, b: 44 }, uirevision: "curves",
      annotations: [...linearFlutter().annotations, ...provedFree("below").annotations],
      shapes: curveShapes() });
}

/** Its name is beyond the line where what is proved free has its own on this side. */
function linearFlutter() {
  const found = marks([[data.axis.flutter ?? null, "linear flutter"]]);
  if (data.free) for (const one of found.annotations) one.xanchor = "left";
  return found;
}

/** The airspeeds at which nothing can oscillate, by proof. */
function provedFree(layer) {
  if (!data.free) return { shapes: [], annotations: [] };
  const { low, high, certified } = data.free;
  return {
    shapes: [
      { type: "rect", x0: low, x1: high, yref: "paper", y0: 0, y1: 1, layer,
        fillcolor: colour("shade-free"), line: { width: 0 } },
      { type: "line", x0: high, x1: high, yref: "paper", y0: 0, y1: 1,
        line: { color: colour("free"), width: 1.5 } },
    ],
    annotations: [{ x: high, yref: "paper", y: 1, text: certified ? "proved free" : "free, not certified",
      showarrow: false, textangle: -90, xanchor: "right", yanchor: "top",
      font: { size: 11, color: colour("free") } }],
  };
}

/** The flutter speed, what is proved free, and a ring around the chosen point. */
function curveShapes() {
  const ring = ({ x, amplitude }) => ({ type: "circle", xsizemode: "pixel", ysizemode: "pixel",
    xanchor: x, yanchor: amplitude, x0: -8, x1: 8, y0: -8, y1: 8,
    line: { color: colour("focus"), width: 3 } });
  const lines = [...provedFree("below").shapes, ...linearFlutter().shapes];
  return [...lines, ...(chosen && chosen.kind !== "cell" ? [ring(chosen)] : [])];
}

// ---------------------------------------------------------------- flutter map

const MAPPED = ["damped", "aperiodic", "divergent", "undecided", "neutral", "failed"];

/** A grid (columns of rows, as it comes) turned for plotly, which wants rows of columns. */
const turned = (values, pick) =>
  data.map.y.values.map((_, j) => data.map.x.values.map((_, i) => pick(values[i][j], i, j)));
const across = () => data.map.x.values.map((value) => value * toPage);
const stateOf = (code) => (code < 0 ? "failed" : data.map.states[code]);

function drawMap() {
  const { y, state, amplitude } = data.map;
  const codes = turned(state, (code) => {
    const place = MAPPED.indexOf(stateOf(code));
    return place < 0 ? null : place;
  });
  const steps = MAPPED.flatMap((name, n) =>
    [n, n + 1].map((edge) => [edge / MAPPED.length, colour(`state-${name}`)]));
  const words = turned(state, (code, i, j) => cellWords(i, j).replaceAll("; ", "<br>"));
  const common = { x: across(), y: y.values, type: "heatmap", xgap: 1, ygap: 1, text: words,
    hovertemplate: "%{text}<extra></extra>", hoverongaps: false };
  const cycles = turned(amplitude, (value, i, j) =>
    stateOf(state[i][j]) === "lco" ? Math.log10(value) : null);
  const some = cycles.flat().some((value) => value !== null);
  const sizes = cycles.flat().filter((value) => value !== null);
  const ticks = some ? decades(Math.floor(Math.min(...sizes)), Math.ceil(Math.max(...sizes)), [1, 1.5, 2, 3, 5, 7]) : [];
  draw("plot-map", [
    { ...common, z: codes, zmin: -0.5, zmax: MAPPED.length - 0.5, colorscale: steps, showscale: false },
    { ...common, z: cycles, colorscale: "Viridis", showscale: some,
      colorbar: { tickvals: ticks.map(Math.log10), ticktext: ticks.map((value) => number(value, 2)),
        title: { text: `amplitude (${NAME})`, side: "right", font: { size: 12 } },
        thickness: 12, outlinewidth: 0, tickfont: { size: 11 } } },
  ], axis(html(data.axis.label), { showgrid: false, zeroline: false }),
  axis(`initial ${y.name} (${y.unit})`, { showgrid: false, zeroline: false }),
  { shapes: mapShapes(), annotations: mapFree().annotations, margin: { l: 52, r: 12, t: 8, b: 44 }, uirevision: "map" });
}

function edges(values, i) {
  const gap = (j) => (values[j + 1] - values[j]) / 2;
  const last = values.length - 1;
  if (last === 0) return [values[0] - 0.5, values[0] + 0.5];
  return [values[i] - gap(Math.max(i - 1, 0)), values[i] + gap(Math.min(i, last - 1))];
}

/** A frame around the chosen cell that is seen on any colour. */
function mapShapes() {
  const free = mapFree().shapes;
  if (!chosen || chosen.kind !== "cell") return free;
  const [[x0, x1], [y0, y1]] = [edges(across(), chosen.i), edges(data.map.y.values, chosen.j)];
  return [...free, ...[["paper", 6], ["ink", 2.5]].map(([name, width]) =>
    ({ type: "rect", x0, x1, y0, y1, line: { color: colour(name), width } }))];
}

/** What is proved free of the speeds of the map. */
function mapFree() {
  const first = edges(across(), 0)[0];
  if (!data.free || data.free.high <= first) return { shapes: [], annotations: [] };
  const found = provedFree("above");
  found.shapes[0].x0 = Math.max(data.free.low, first);
  return found;
}

function cellWords(i, j) {
  const { x, y, state, amplitude, bias, period, rest, decided } = data.map;
  const name = stateOf(state[i][j]);
  const where = `speed ${number(x.values[i] * toPage)}${SPEED}, initial ${y.name} ${number(y.values[j])}${y.mark}`;
  const small = Math.abs(bias[i][j]) < 1e-6 * Math.abs(amplitude[i][j]) ? 0 : bias[i][j];
  const end = {
    lco: `limit cycle of amplitude ${told(amplitude[i][j])}, bias ${told(small)}, ` +
      periodWords(period[i][j], x.values[i] * toPage),
    damped: `damped, rests at ${told(rest[i][j], 3)}`,
    aperiodic: `aperiodic, amplitude about ${told(amplitude[i][j], 3)}`,
  }[name] || name;
  const known = name === "undecided" ? "marched to" : "certain after";
  const when = decided[i][j] * second(x.values[i] * toPage);
  return `${where}; ${end}; ${known} ${CLOCK} = ${number(when, 4)}${UNIT}`;
}

// ---------------------------------------------------------------- the chosen motion

/** Seconds of one τ at a speed of the page, where it is in m/s; else 1. */
const second = (speed) => (data.axis.semichord ? data.axis.semichord / speed : 1);
const UNIT = data.axis.semichord || data.axis.seconds ? " s" : "";
const CLOCK = UNIT ? "t" : "τ";

/** A period in the words of the page, with its frequency where that has a unit. */
function periodWords(tau, speed) {
  const period = tau * second(speed);
  return UNIT ? `period ${number(period)} s (${number(1 / period, 4)} Hz)` : `period ${number(period)}`;
}

function drawMotion() {
  const whole = motion(chosen.motion);
  whole.time = whole.time.map((value) => value * second(chosen.speed));
  const cycle = chosen.settled < 0 ? null : motion(chosen.settled);
  const line = (name) => ({ color: colour(name), width: 1.5, shape: "spline", smoothing: 0.7 });
  const { beside } = data;
  const trace = (key, name, more) => ({ x: whole.time, y: whole[key], mode: "lines", name: key,
    line: line(name), ...more });
  draw("plot-traces", [
    trace("pitch", "line-exact", { hovertemplate: `${CLOCK} = %{x:.5g}${UNIT}<br>${data.coordinate} %{y:.5g}${MARK}<extra></extra>` }),
    ...(beside ? [trace("beside", "line-exact", { yaxis: "y2",
      hovertemplate: `${CLOCK} = %{x:.5g}${UNIT}<br>${beside.name} %{y:.5g}${beside.mark}<extra></extra>` })] : []),
  ], axis(UNIT ? "time (s)" : "time τ", { anchor: beside ? "y2" : "y" }),
  axis(COORDINATE, { domain: beside ? [0.54, 1] : [0, 1] }),
  { yaxis2: axis(beside ? beside.label : "", { automargin: true, domain: [0, 0.46], visible: Boolean(beside) }), margin: { l: 68, r: 12, t: 8, b: 44 },
    shapes: cycle ? reach(cycle.pitch) : [] });
  const path = (values, width, opacity, name) => ({ x: values.pitch, y: values.moment, opacity,
    mode: "lines", name, line: { color: colour("line-exact"), width },
    hovertemplate: `%{x:.5g}${MARK}<br>${EFFORT} %{y:.5g}${MARK}<extra></extra>` });
  const paths = cycle
    ? [path(whole, 1, 0.45, "from the start"), path(cycle, 2.6, 1, "limit cycle")]
    : [path(whole, chosen.kind === "cell" ? 1.2 : 2.2, 1, "path")];
  const seen = (key) => (cycle ? { range: around(cycle[key]) } : {});
  draw("plot-path", paths, axis(COORDINATE, seen("pitch")),
    axis(RESTORING, seen("moment")),
    { showlegend: Boolean(cycle), margin: { l: 52, r: 12, t: 10, b: 44 } });
}

/** Limits in which a cycle fills half the frame. */
function around(values) {
  const [low, high] = [Math.min(...values), Math.max(...values)];
  return [1.5 * low - 0.5 * high, 1.5 * high - 0.5 * low];
}

/** Dotted lines between which the settled cycle swings. */
function reach(pitch) {
  return [Math.min(...pitch), Math.max(...pitch)].map((y) => ({ type: "line", xref: "paper",
    x0: 0, x1: 1, y0: y, y1: y, line: { color: colour("faint"), width: 1, dash: "dot" } }));
}

// What a reader does with the figures: chooses, prints, changes the theme; and how the page starts.

const PRINTED = 680; // pixels across a printed page

let samples = null; // bytes of all motions
let starts = [];
let cursor = { curve: 0, point: 0, event: -1, column: 0, row: 0 };

// ---------------------------------------------------------------- reading what the page carries

async function inflate(base64) {
  const text = atob(base64);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i); // far faster than `from`
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}

async function loadPlotly() {
  const element = byId("plotly");
  const script = document.createElement("script");
  script.textContent = new TextDecoder().decode(await inflate(element.textContent));
  document.head.append(script);
  element.remove();
}

async function loadMotions() {
  samples = await inflate(data.motions.samples);
  delete data.motions.samples;
  let start = 0;
  starts = data.motions.headers.map(([count]) => {
    const here = start;
    start += 8 * count;
    return here;
  });
}

/** Samples of a motion as plain arrays: time, the coordinate of the spring, what is beside it, moment. */
function motion(number) {
  const [count, step, ...units] = data.motions.headers[number];
  const view = new DataView(samples, starts[number], 8 * count);
  const column = (n, read) => Array.from({ length: count }, (_, i) => read(2 * (n * count + i)));
  const [pitch, beside, moment] = units.map((unit, n) =>
    column(n + 1, (at) => unit * view.getInt16(at, true)));
  return { time: column(0, (at) => step * view.getUint16(at, true)), pitch, beside, moment };
}

// ---------------------------------------------------------------- choosing a motion

function chooseCell(i, j) {
  cursor = { ...cursor, column: i, row: j };
  choose({ kind: "cell", i, j, speed: data.map.x.values[i] * toPage, motion: data.map.motion + i * data.map.y.values.length + j,
    settled: data.map.settled[i][j], words: `${cellWords(i, j)}.` });
}

function choosePoint(n, i) {
  const curve = data.curves[n];
  cursor = { ...cursor, curve: n, point: i };
  choose({ kind: "point", x: curve.x[i], speed: curve.x[i], amplitude: curve.amplitude[i], motion: curve.motion + i,
    settled: -1, words: `${METHODS[curve.method]}, ${curve.stable[i] ? "stable" : "unstable"} ` +
      `cycle at speed ${number(curve.x[i], 6)}${SPEED}: amplitude ${told(curve.amplitude[i])}, ` +
      `${periodWords(curve.period[i], curve.x[i])}.` });
}

function chooseEvent(n) {
  const event = data.events[n];
  cursor.event = n;
  choose({ kind: "event", x: event.x, speed: event.x, amplitude: event.amplitude, motion: event.motion, settled: -1,
    words: `${event.kind} at speed ${number(event.x, 7)}${SPEED}: amplitude ` +
      `${told(event.amplitude)}, ${periodWords(event.period, event.x)}.` });
}

function choose(what) {
  chosen = what;
  byId("chosen").textContent = what.words[0].toUpperCase() + what.words.slice(1);
  byId("chosen").dataset.motion = what.motion;
  mark("plot-curves", curveShapes());
  if (data.map) mark("plot-map", mapShapes());
  if (isDrawn("plot-traces")) drawMotion();
}

/** Shapes alone: a figure of thousands of numbers is not drawn again for a ring. */
function mark(id, shapes) {
  if (isDrawn(id)) Plotly.relayout(id, { shapes });
}

// ---------------------------------------------------------------- mouse, keys, theme, print

const NEAR = 8; // pixels from the centre of a bifurcation's mark, within which it is meant

/** The bifurcation under the pointer: its mark lies on a curve, whose points are as near. */
function eventAt({ clientX, clientY }) {
  const plot = byId("plot-curves");
  const box = plot.getBoundingClientRect();
  const { xaxis, yaxis } = plot._fullLayout;
  const away = data.events.map((one) => Math.hypot(
    box.left + xaxis._offset + xaxis.d2p(one.x) - clientX,
    box.top + yaxis._offset + yaxis.d2p(one.amplitude) - clientY));
  const least = Math.min(...away);
  return least < NEAR ? away.indexOf(least) : -1;
}

function clicked(id, take) {
  byId(id).on("plotly_click", ({ points, event }) => {
    take(points[0], event);
    if (window.matchMedia("(max-width: 60rem)").matches) byId("motion").scrollIntoView();
  });
}

function keyed(id, moves) {
  byId(id).addEventListener("keydown", (event) => {
    if (!(event.key in moves) || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    moves[event.key]();
  });
}

const within = (value, count) => Math.min(Math.max(value, 0), count - 1);

function stepCell(across, up) {
  const [columns, rows] = [data.map.x.values.length, data.map.y.values.length];
  chooseCell(within(cursor.column + across, columns), within(cursor.row + up, rows));
}

function stepPoint(along, curves) {
  const n = within(cursor.curve + curves, data.curves.length);
  const { x } = data.curves[n];
  const here = data.curves[cursor.curve].x[cursor.point];
  const near = () => x.reduce((best, value, i) =>
    (Math.abs(value - here) < Math.abs(x[best] - here) ? i : best), 0);
  choosePoint(n, n === cursor.curve ? within(cursor.point + along, x.length) : near());
}

/** The roots at the next airspeed of the linear figures, read out and marked. */
function stepLinear(along) {
  linearAt = within((linearAt ?? 0) + along, data.locus.speeds.length);
  byId("linear-said").textContent = linearWords(linearAt);
  drawLocus();
}

function stepEvent(along) {
  if (!data.events.length) return;
  chooseEvent(within(cursor.event + along, data.events.length));
}

function listen() {
  if (data.map) clicked("plot-map", (point) => chooseCell(...point.pointIndex.toReversed()));
  if (data.map) keyed("plot-map", { ArrowLeft: () => stepCell(-1, 0), ArrowRight: () => stepCell(1, 0),
    ArrowUp: () => stepCell(0, 1), ArrowDown: () => stepCell(0, -1),
    Home: () => stepCell(-Infinity, 0), End: () => stepCell(Infinity, 0),
    Enter: () => stepCell(0, 0) });
  if (data.curves.length) {
    clicked("plot-curves", ({ customdata }, pointer) => {
      const under = pointer ? eventAt(pointer) : -1;
      if (under >= 0) return void chooseEvent(under);
      if (!customdata) return;
      if (customdata[0] < 0) chooseEvent(customdata[1]);
      else choosePoint(customdata[0], customdata[1]);
    });
    keyed("plot-curves", { ArrowLeft: () => stepPoint(-1, 0), ArrowRight: () => stepPoint(1, 0),
      ArrowUp: () => stepPoint(0, -1), ArrowDown: () => stepPoint(0, 1),
      PageUp: () => stepEvent(-1), PageDown: () => stepEvent(1),
      Home: () => stepPoint(-Infinity, 0), End: () => stepPoint(Infinity, 0),
      Enter: () => stepPoint(0, 0) });
  }
  keyed("linear-figures", { ArrowLeft: () => stepLinear(-1), ArrowRight: () => stepLinear(1),
    Home: () => stepLinear(-Infinity), End: () => stepLinear(Infinity) });
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const button = byId("theme");
  const say = (on) => { // what the button does, which is the other theme
    button.dataset.dark = on;
    button.textContent = on ? "Light theme" : "Dark theme";
  };
  const theme = (on) => {
    document.documentElement.style.colorScheme = on ? "dark" : "light";
    say(on);
    drawAll();
  };
  say(dark.matches);
  button.addEventListener("click", () => theme(button.dataset.dark !== "true"));
  dark.addEventListener("change", () => theme(dark.matches));
  window.addEventListener("beforeprint", () => printing(true));
  window.addEventListener("afterprint", () => printing(false));
}

/** Paper is white, whatever the theme; and figures do not follow its width by themselves. */
function printing(on) {
  const { style, dataset } = document.documentElement;
  if (on) dataset.scheme ??= style.colorScheme;
  style.colorScheme = on ? "light" : dataset.scheme;
  if (!on) delete dataset.scheme;
  drawAll();
  for (const plot of document.querySelectorAll(".js-plotly-plot")) {
    const small = plot.classList.contains("small");
    const [width, height] = small ? [PRINTED / 3 - 10, 240] : [PRINTED, plot.clientHeight];
    Plotly.relayout(plot, on ? { width, height, autosize: false }
      : { width: null, height: null, autosize: true });
  }
}

/** What is shown first: a limit cycle in the middle of the map, or what else is there. */
function first() {
  const codes = data.map.state.map((column) => column.map(stateOf));
  const found = codes.flatMap((column, i) => column.flatMap((name, j) =>
    (name === "lco" ? [[i, j]] : [])));
  const middle = [Math.floor(codes.length / 2), Math.floor(codes[0].length / 2)];
  const off = ([, j]) => Math.abs(j - middle[1]);
  const best = found.filter((cell) => off(cell) === Math.min(...found.map(off)));
  return best.length ? best[Math.floor(best.length / 2)] : middle;
}

const FIGURES = { "plot-spring": drawSpring, "plot-locus": drawLocus, "plot-curves": drawCurves,
  "plot-map": drawMap, "plot-traces": drawMotion };
const figures = () => Object.keys(FIGURES).filter((id) => !byId(id).hidden);
const isDrawn = (id) => byId(id).classList.contains("js-plotly-plot");

function drawAll() {
  colours.clear();
  for (const id of figures()) FIGURES[id]();
}

function inView(id) {
  const { top, bottom } = byId(id).getBoundingClientRect();
  return bottom > 0 && top < window.innerHeight;
}

/** What a reader sees is drawn first; between the others the page answers. */
async function drawFirst() {
  for (const id of figures().filter(inView)) FIGURES[id]();
  ready("seen");
  for (const id of figures().filter((one) => !isDrawn(one))) {
    await new Promise((resume) => { setTimeout(resume); });
    FIGURES[id]();
  }
}

/** For whoever waits: "seen" when the figures in view are there, "yes" when all are. */
function ready(word) {
  document.documentElement.dataset.ready = word;
  performance.mark(word);
}

async function main() {
  for (const cell of document.querySelectorAll(".speed-label")) cell.textContent = data.axis.label;
  byId("linear-said").textContent = "";
  try {
    await Promise.all([loadPlotly(), loadMotions()]);
  } catch (error) {
    byId("problem").hidden = false;
    byId("problem").textContent = `The figures cannot be shown: ${error.message}. ` +
      "A browser of 2023 or later is needed.";
    return;
  }
  byId("plot-curves").hidden = byId("hint-curves").hidden = !data.curves.length;
  byId("plot-map").hidden = !data.map;
  if (data.map) chooseCell(...first());
  else if (data.curves.length) choosePoint(data.curves.length - 1, Math.floor(data.curves.at(-1).x.length / 2));
  else byId("motion").closest("section").hidden = byId("plot-traces").hidden = true;
  await drawFirst();
  listen();
  ready("yes");
}

main();

// Axes on a canvas, which all pictures use.

const colour = (name) =>
  getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();

/** Return about `count` round numbers that cover an interval. */
function ticksOf(low, high, count) {
  const rough = (high - low) / count, power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].find((factor) => factor * power >= rough) * power;
  const ticks = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++)
    ticks.push(Number((k * step).toPrecision(12)));
  return ticks;
}

/** Return a tick as text. */
const tickText = (x) => (x !== 0 && (Math.abs(x) < 1e-3 || Math.abs(x) >= 1e5)
  ? x.toExponential(0) : String(x)).replace("-", "\u2212");

/**
 * Picture with axes. `paint(axes)` draws the parts that do not change in time, once and into a
 * separate canvas. `overlay(axes, moment)` draws the parts that belong to a moment.
 */
class Picture {
  constructor(id, { paint, overlay = () => {}, left = 52, bottom = 38, top = 10, right = 12 }) {
    this.canvas = document.getElementById(id);
    this.base = document.createElement("canvas");
    Object.assign(this, { paint, overlay, left, bottom, top, right, stale: true });
  }

  /** Request new painting, because the data, the size or the theme changed. */
  forget() {
    this.stale = true;
  }

  draw(moment) {
    const ratio = window.devicePixelRatio || 1;
    const wide = this.canvas.clientWidth, high = this.canvas.clientHeight;
    if (!wide || !high) return;
    const width = Math.round(wide * ratio), height = Math.round(high * ratio);
    if (this.stale || this.base.width !== width || this.base.height !== height) {
      for (const canvas of [this.canvas, this.base]) [canvas.width, canvas.height] = [width, height];
      Object.assign(this, { wide, high, ratio });
      this.begin(this.base);
      this.paint(this);
      this.stale = false;
    }
    this.begin(this.canvas);
    this.pen.setTransform(1, 0, 0, 1, 0, 0);
    this.pen.clearRect(0, 0, width, height);
    this.pen.drawImage(this.base, 0, 0);
    this.pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.overlay(this, moment);
  }

  begin(canvas) {
    this.pen = canvas.getContext("2d");
    this.pen.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    if (canvas === this.base) this.pen.clearRect(0, 0, this.wide, this.high);
    this.pen.font = "13px system-ui, sans-serif";
  }

  /** Set the ranges of the axes; for a logarithmic y axis, by exponents. */
  span(x0, x1, y0, y1) {
    Object.assign(this, { x0, x1, y0, y1 });
    this.inner = [this.wide - this.left - this.right, this.high - this.top - this.bottom];
  }

  x(value) {
    return this.left + this.inner[0] * (value - this.x0) / (this.x1 - this.x0);
  }

  y(value) {
    return this.top + this.inner[1] * (1 - (value - this.y0) / (this.y1 - this.y0));
  }

  /** Draw axes and labels; `numbers` at the ticks of x; `logarithmic` marks powers of ten in y. */
  axes(xLabel, yLabel, { numbers = true, logarithmic = false, grid = true } = {}) {
    const { pen, left, top } = this, [width, height] = this.inner;
    pen.lineWidth = 1;
    pen.fillStyle = colour("ink");
    pen.textBaseline = "top";
    pen.textAlign = "center";
    for (const tick of ticksOf(this.x0, this.x1, Math.max(2, width / 90))) {
      this.line([[tick, this.y0], [tick, this.y1]], "grid", grid ? 1 : 0);
      if (numbers) pen.fillText(tickText(tick), this.x(tick), top + height + 5);
    }
    const middle = left + width / 2; // labels that would not fit are condensed
    pen.fillText(xLabel, middle, this.high - 15, 2 * Math.min(middle, this.wide - middle));
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    const step = Math.max(1, Math.ceil((this.y1 - this.y0) / (height / 32)));
    const ticks = logarithmic
      ? ticksOf(this.y0, this.y1, 40).filter((k) => Number.isInteger(k) && k % step === 0)
      : ticksOf(this.y0, this.y1, Math.max(2, height / 45));
    for (const tick of ticks) {
      this.line([[this.x0, tick], [this.x1, tick]], "grid", grid ? 1 : 0);
      if (!logarithmic) pen.fillText(tickText(tick), left - 6, this.y(tick));
      else if (tick === 0) pen.fillText("1", left - 6, this.y(tick));
      else {
        const power = String(tick).replace("-", "\u2212");
        pen.font = "10px system-ui, sans-serif";
        pen.fillText(power, left - 6, this.y(tick) - 4);
        const back = pen.measureText(power).width;
        pen.font = "13px system-ui, sans-serif";
        pen.fillText("10", left - 7 - back, this.y(tick) + 1);
      }
    }
    pen.save();
    const centre = top + height / 2;
    pen.translate(10, centre);
    pen.rotate(-Math.PI / 2);
    pen.textAlign = "center";
    pen.fillText(yLabel, 0, 0, 2 * Math.min(centre, this.high - centre));
    pen.restore();
    pen.strokeStyle = colour("ink");
    pen.beginPath();
    pen.moveTo(left, top);
    pen.lineTo(left, top + height);
    pen.lineTo(left + width, top + height);
    pen.stroke();
  }

  /** Draw a polyline through points in units of the axes. */
  line(points, name, width = 1.5, dash = []) {
    if (!width) return;
    const { pen } = this;
    pen.save();
    pen.strokeStyle = colour(name);
    pen.lineWidth = width;
    pen.setLineDash(dash);
    pen.beginPath();
    points.forEach(([x, y], k) => pen[k ? "lineTo" : "moveTo"](this.x(x), this.y(y)));
    pen.stroke();
    pen.restore();
  }

  /** Draw a full or hollow dot at a position in pixels. */
  dot(x, y, radius, name, full = true) {
    const { pen } = this;
    pen.beginPath();
    pen.arc(x, y, radius, 0, 7);
    pen.lineWidth = 1.5;
    pen.strokeStyle = pen.fillStyle = colour(name);
    if (full) pen.fill();
    else pen.stroke();
  }
}

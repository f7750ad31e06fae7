"use strict";
(() => {
  const root = document.documentElement;
  let charts = {}, palettes = {};
  const system = window.matchMedia("(prefers-color-scheme: dark)");
  const touch = window.matchMedia("(pointer: coarse)").matches;
  const buttons = ["zoom2d", "pan2d", "zoomIn2d", "zoomOut2d", "resetScale2d", "toImage"];
  const config = { responsive: true, displaylogo: false, displayModeBar: "hover", modeBarButtons: [buttons] };
  const hovers = window.matchMedia("(hover: hover)").matches;
  const places = [...document.querySelectorAll(".live[data-chart]")];

  // Figures and the library that draws them are packed: a quarter of their size.
  const unpacked = (id) => {
    const script = document.getElementById(id);
    return gaidentUnpack(script.textContent, Number(script.dataset.bytes));
  };
  const load = async () => {
    await new Promise((done) => setTimeout(done));  // the page is shown before its figures are unpacked
    ({ charts, palettes } = JSON.parse(unpacked("figures")));
    if (!places.length) return;
    const library = document.createElement("script");
    library.textContent = unpacked("library");
    document.head.append(library);
  };
  const loaded = load();

  const theme = () => root.dataset.theme || (system.matches ? "dark" : "light");

  // "@role" is a colour of the theme, "@role/0.25" the same with that opacity.
  const coloured = (value, palette) => {
    if (typeof value === "string" && value[0] === "@") {
      const [role, opacity] = value.slice(1).split("/");
      const hex = palette[role];
      if (opacity === undefined) return hex;
      const parts = [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16));
      return `rgba(${parts.join(",")},${opacity})`;
    }
    if (Array.isArray(value)) return typeof value[0] === "number" ? value : value.map((v) => coloured(v, palette));
    if (value !== null && typeof value === "object") {
      return Object.fromEntries(Object.entries(value).map(([key, v]) => [key, coloured(v, palette)]));
    }
    return value;
  };

  const draw = (place) => {
    const { data, layout } = coloured(charts[place.dataset.chart], palettes[theme()]);
    const old = place.layout && place.layout.xaxis && !place.layout.xaxis.autorange ? place.layout.xaxis.range : null;
    if (old) layout.xaxis.range = [...old];
    layout.dragmode = touch ? false : "zoom";
    layout.modebar.orientation = hovers ? "v" : "h";  // where nothing hovers it is always there, above the figure
    if (place.clientWidth < 500) {
      layout.margin = { ...layout.margin, l: 58, r: 6 };
      layout.font.size = 11;
      layout.legend.font.size = 10;
    }
    place.parentElement.classList.add("drawn");
    return Plotly.react(place, data, layout, config).catch((error) => {
      place.parentElement.classList.remove("drawn");  // the picture stands in for it
      throw error;
    });
  };

  // Charts of one link show the same stretch of x.
  let following = false;
  const follow = (place) => {
    const { link } = charts[place.dataset.chart];
    const others = places.filter((p) => link && p !== place && charts[p.dataset.chart].link === link);
    if (!others.length) return;
    place.on("plotly_relayout", (change) => {
      if (following) return;
      const range = ["xaxis.range[0]", "xaxis.range[1]"].map((key) => change[key]);
      const update = change["xaxis.autorange"] ? { "xaxis.autorange": true } : range[0] !== undefined ? { "xaxis.range": range } : null;
      if (!update) return;
      following = true;
      Promise.all(others.map((p) => Plotly.relayout(p, update))).finally(() => { following = false; });
    });
  };

  const repaint = () => loaded.then(() => Promise.all(places.map(draw)));
  for (const button of document.querySelectorAll(".switch button")) {
    button.addEventListener("click", () => {
      if (button.dataset.set === "auto") delete root.dataset.theme;
      else root.dataset.theme = button.dataset.set;
      for (const b of document.querySelectorAll(".switch button")) b.setAttribute("aria-pressed", String(b === button));
      repaint();
    });
  }
  system.addEventListener("change", () => { if (!root.dataset.theme) repaint(); });
  window.gaidentReady = repaint().then(() => places.forEach(follow)).then(() => true);
})();

"use strict";
// Inflates plotly and the data of the plots, and draws each plot when it comes into view.
(async () => {
  const place = (id) => document.getElementById(id);
  if (!place("plotly") || typeof DecompressionStream === "undefined") return;
  const inflated = async (id) => {
    const bytes = Uint8Array.from(atob(place(id).textContent.trim()), (c) => c.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Response(stream).text();
  };
  const script = document.createElement("script");
  script.textContent = await inflated("plotly");
  document.head.append(script);
  const plots = JSON.parse(await inflated("plots"));
  const narrow = matchMedia("(max-width: 700px)").matches;
  const small = { size: narrow ? 10 : 12 };
  const draw = (box) => {
    const { data, layout, frames } = plots[box.dataset.plot];
    if (layout.height && narrow) layout.height = 0.75 * layout.height;
    const axis = { gridcolor: "#e3e5e8", zeroline: false, automargin: true };
    const full = {
      font: { family: 'system-ui, "DejaVu Sans", sans-serif', ...small },
      margin: { l: 50, r: 16, t: data.some((t) => t.showlegend) ? 60 : 34, b: 44 },
      legend: { orientation: "h", yanchor: "bottom", y: 1.0, x: 0 },
      modebar: { orientation: data.some((t) => t.showlegend) ? "v" : "h" },
      paper_bgcolor: "#fff", plot_bgcolor: "#fff", hovermode: "closest", ...layout,
    };
    for (const name of Object.keys(full)) {
      if (/^[xy]axis/.test(name)) full[name] = { ...axis, ...full[name] };
    }
    if (full.title) {
      const heading = document.createElement("h4");
      heading.innerHTML = full.title.text;
      box.before(heading);
      delete full.title;
    }
    const config = { displaylogo: false, responsive: true, displayModeBar: narrow ? false : "hover",
      modeBarButtonsToRemove: ["lasso2d", "select2d", "toImage"] };
    Plotly.newPlot(box, data, full, config).then(() => frames && Plotly.addFrames(box, frames));
  };
  const watcher = new IntersectionObserver((entries) => {
    for (const entry of entries) {
      if (!entry.isIntersecting) continue;
      watcher.unobserve(entry.target);
      draw(entry.target);
    }
  }, { rootMargin: "400px" });
  for (const box of document.querySelectorAll("[data-plot]")) {
    box.closest("figure").classList.add("live");
    watcher.observe(box);
  }
})();

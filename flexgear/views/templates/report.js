"use strict";
// Sections open when a link leads to them, and all at once by a button.
(() => {
  const chapters = [...document.querySelectorAll("details.chapter")];
  for (const link of document.querySelectorAll('a[href^="#"]')) {
    const there = document.querySelector(`${link.getAttribute("href")} > details.chapter`);
    if (there) link.addEventListener("click", () => { there.open = true; });
  }
  const button = document.querySelector("nav button.all");
  if (!button) return;
  button.hidden = false;
  const label = () => { button.textContent = chapters.some((c) => c.open) ? "Close all" : "Open all"; };
  button.onclick = () => {
    const open = !chapters.some((c) => c.open);
    for (const chapter of chapters) chapter.open = open;
  };
  for (const chapter of chapters) chapter.addEventListener("toggle", label);
})();
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
  // Buttons above a body in its modes: x = rest + cos(phase) * mode, and the colours of the mode.
  const swinging = (box, trace, { rest, modes }) => {
    let mode = modes[0], swings = false;
    const shape = (share) => rest.map((at, k) => at.map((v, n) => v + share * mode.by[k][n]));
    const show = (share) => {
      const [x, y, z] = shape(share);
      return Plotly.restyle(box, { x: [x], y: [y], z: [z], intensity: [mode.size] }, [0]);
    };
    [trace.x, trace.y, trace.z] = shape(1);
    const row = document.createElement("div");
    const heading = document.createElement("h4");
    row.className = "modes";
    const button = (label, press) => {
      const made = document.createElement("button");
      made.type = "button";
      made.textContent = label;
      made.onclick = () => press(made);
      row.append(made);
      return made;
    };
    const mark = (chosen) => {
      for (const choice of choices) choice.setAttribute("aria-pressed", choice === chosen);
      heading.textContent = chosen.textContent;
    };
    const choices = modes.map((one) => button(one.label, (made) => {
      mode = one;
      mark(made);
      if (!swings) show(1);
    }));
    mark(choices[0]);
    button("▶ swing", async (made) => {
      swings = !swings;
      made.textContent = swings ? "❚❚" : "▶ swing";
      const start = performance.now();
      while (swings) {
        await show(Math.cos((performance.now() - start) / 300));
        await new Promise(requestAnimationFrame);
      }
      show(1);
    });
    box.before(row, heading);
  };
  const draw = (box) => {
    const { data, layout, swing } = plots[box.dataset.plot];
    const entries = data.filter((t) => t.showlegend).length;
    if (narrow) { // entries of the legend stand one below another
      layout.height = (layout.height ? 0.75 * layout.height : 340) + 24 * Math.max(0, entries - 3);
    }
    const crowded = layout.annotations?.some((text) =>
      text.yanchor === "bottom" && text.y >= layout.yaxis.range[1]); // texts above the panel
    const axis = { gridcolor: "#e3e5e8", zeroline: false, automargin: true };
    const full = {
      font: { family: 'system-ui, "DejaVu Sans", sans-serif', ...small },
      margin: { l: 50, r: 16, t: entries ? 60 : 34, b: 44 },
      legend: { orientation: "h", yanchor: "bottom", y: crowded ? 1.06 : 1.0, x: 0 },
      modebar: { orientation: entries ? "v" : "h" },
      paper_bgcolor: "#fff", plot_bgcolor: "#fff", hovermode: "closest", ...layout,
    };
    for (const name of Object.keys(full)) {
      if (/^[xy]axis/.test(name)) full[name] = { ...axis, ...full[name] };
      const title = full[name].title; // across a narrow page in several lines
      if (narrow && title?.text && name.startsWith("x")) {
        title.text = title.text.split(/(?<=;) /).map((part) =>
          part.replace(/(.{24,32}) (?=.{8})/g, "$1<br>")).join("<br>");
      }
    }
    const heading = document.createElement("h4");
    if (full.title) {
      heading.innerHTML = full.title.text;
      box.before(heading);
      delete full.title;
      // a button that changes what is shown changes the heading, not a title in the plot
      for (const button of (full.updatemenus ?? []).flatMap((menu) => menu.buttons)) {
        const titled = button.args[1];
        if (!titled?.["title.text"]) continue;
        button.name = titled["title.text"];
        delete titled["title.text"];
      }
    }
    const config = { displaylogo: false, showSendToCloud: false, responsive: true,
      displayModeBar: narrow ? false : "hover", modeBarButtonsToRemove: ["lasso2d", "select2d", "toImage"] };
    if (swing) swinging(box, data[0], swing);
    Plotly.newPlot(box, data, full, config).then(() => {
      box.on("plotly_buttonclicked", ({ button }) => {
        if (button.name) heading.innerHTML = button.name;
      });
    });
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

for (const button of document.querySelectorAll(".code button")) {
  button.onclick = async () => {
    const code = button.nextElementSibling;
    try {
      await navigator.clipboard.writeText(code.textContent);
      button.textContent = "copied";
    } catch {
      getSelection().selectAllChildren(code); // no access to the clipboard: ready for the keyboard
    }
  };
}
const packed = document.getElementById("library");
if (packed) {
  const scheme = matchMedia("(prefers-color-scheme: dark)");
  const config = {
    responsive: true,
    displaylogo: false,
    displayModeBar: innerWidth > 640 && "hover",
    modeBarButtons: [["toImage", "zoom2d", "pan2d", "resetScale2d"]],
  };
  const plots = [...document.querySelectorAll(".plot")].map((place) => [place, place.textContent]);
  for (const [place] of plots) place.replaceChildren();
  const draw = () => {
    const own = getComputedStyle(document.documentElement);
    for (let [place, text] of plots) {
      for (const name in stand) text = text.replaceAll(stand[name], own.getPropertyValue("--" + name));
      const figure = JSON.parse(text);
      Plotly.react(place, figure.data, figure.layout, config);
    }
    document.documentElement.dataset.drawn = document.querySelectorAll(".plot .svg-container").length;
  };
  const bytes = Uint8Array.from(atob(packed.textContent), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  new Response(stream).text().then((code) => {
    const script = document.createElement("script");
    script.textContent = code;
    document.head.append(script);
    draw();
    scheme.addEventListener("change", draw);
  });
}

// Everything reads without this script. It offers each figure as SVG and PNG, in light colours, for papers and talks,
// and opens what is folded where a link leads to it, and before the page is printed.
(() => {
  const light = (svg) => new XMLSerializer().serializeToString(svg).replace(/var\(--[\w-]+, (#[0-9a-f]{6})\)/g, "$1");
  const download = (url, name) => Object.assign(document.createElement("a"), { href: url, download: name }).click();
  const standalone = (svg, scale) => {
    const copy = svg.cloneNode(true);
    copy.querySelectorAll(".move").forEach((one) => one.remove());
    const { width, height } = svg.viewBox.baseVal;
    copy.setAttribute("width", width * scale);
    copy.setAttribute("height", height * scale);
    copy.setAttribute("font-family", "DejaVu Sans, Verdana, Arial, sans-serif");
    return URL.createObjectURL(new Blob([light(copy)], { type: "image/svg+xml" }));
  };
  const savePng = (svg, name) => {
    const picture = new Image();
    picture.onload = () => {
      const canvas = Object.assign(document.createElement("canvas"), { width: picture.width, height: picture.height });
      const brush = canvas.getContext("2d");
      brush.fillStyle = "#ffffff";
      brush.fillRect(0, 0, canvas.width, canvas.height);
      brush.drawImage(picture, 0, 0);
      download(canvas.toDataURL("image/png"), name + ".png");
    };
    picture.src = standalone(svg, 4);
  };
  for (const figure of document.querySelectorAll("figure")) {
    const svg = figure.querySelector("svg");
    const save = Object.assign(document.createElement("span"), { className: "save" });
    const offers = { SVG: () => download(standalone(svg, 1), figure.id + ".svg"), PNG: () => savePng(svg, figure.id) };
    for (const [kind, act] of Object.entries(offers)) {
      const title = "Save this figure as " + kind;
      save.append(Object.assign(document.createElement("button"), { textContent: kind, title, onclick: act }));
    }
    figure.querySelector("figcaption").append(save);
  }
  const unfold = () => {
    const target = location.hash && document.getElementById(decodeURIComponent(location.hash.slice(1)));
    for (let one = target && target.closest("details"); one; one = one.parentElement.closest("details")) one.open = true;
    if (target) target.scrollIntoView();
  };
  addEventListener("hashchange", unfold);
  unfold();
  addEventListener("beforeprint", () => document.querySelectorAll("details").forEach((one) => { one.open = true; }));
})();

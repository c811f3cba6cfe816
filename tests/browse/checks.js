// What a page must not make hard: names of all that can be pressed or filled in, contrast, sizes for thumbs, one language.
// Returns what is wrong, a line each. Contrast as WCAG 2.2 reckons it (1.4.3: 4.5, large text 3).
(() => {
  const wrong = [];
  const told = (element) => `<${element.tagName.toLowerCase()}${element.id ? ` id=${element.id}` : ""}>`;
  const isShown = (element) => element.checkVisibility() && !element.closest(".hidden") && !element.closest("[aria-hidden=true]");

  if (!document.documentElement.lang) wrong.push("the page does not tell its language");
  if (!document.title) wrong.push("the page has no title");
  if (document.querySelectorAll("main").length !== 1) wrong.push("not one <main>");
  if (document.querySelectorAll("h1").length !== 1) wrong.push("not one <h1>");
  const ids = [...document.querySelectorAll("[id]")].map((e) => e.id);
  for (const id of new Set(ids.filter((id, k) => ids.indexOf(id) !== k))) wrong.push(`two elements are ${id}`);
  let level = 1;
  for (const heading of [...document.querySelectorAll("h1,h2,h3,h4")].filter(isShown)) {
    const its = Number(heading.tagName[1]);
    if (its > level + 1) wrong.push(`${told(heading)} “${heading.textContent}” skips a level`);
    level = its;
  }

  const nameOf = (element) => (element.getAttribute("aria-label") || [...(element.labels ?? [])].map((l) => l.textContent).join(" ")
    || (element.matches("input,select,textarea") ? "" : element.textContent) || element.title || element.alt || "").trim();
  for (const element of [...document.querySelectorAll("button,a[href],input,select,textarea,canvas,[tabindex]")].filter(isShown)) {
    if (!nameOf(element)) wrong.push(`${told(element)} has no name for a screen reader`);
    const box = element.getBoundingClientRect();
    // WCAG 2.2, 2.5.8: 24 pixels, unless it stands within a sentence.
    const target = element.type === "checkbox" ? element.closest("label").getBoundingClientRect() : box;
    if (!element.closest("p") && Math.min(target.width, target.height) < 24) wrong.push(`${told(element)} is ${target.width} × ${target.height} pixels`);
    if (element.tabIndex > 0) wrong.push(`${told(element)} jumps the order of Tab`);
  }
  for (const image of document.querySelectorAll("img:not([alt])")) wrong.push(`${told(image)} has no alt`);
  if (document.documentElement.scrollWidth > innerWidth + 1) wrong.push(`wider than the screen: ${document.documentElement.scrollWidth}`);

  const canvas = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
  const rgba = (colour) => {
    canvas.clearRect(0, 0, 1, 1);
    canvas.fillStyle = colour;
    canvas.fillRect(0, 0, 1, 1);
    const [r, g, b, a] = canvas.getImageData(0, 0, 1, 1).data;
    return [r, g, b, a / 255];
  };
  const behind = (element) => {
    const layers = [];
    for (let at = element; at; at = at.parentElement) layers.push(rgba(getComputedStyle(at).backgroundColor));
    return layers.reverse().reduce((under, [r, g, b, a]) => under.map((u, k) => u * (1 - a) + [r, g, b][k] * a), [255, 255, 255]);
  };
  const luminance = (rgb) => {
    const [r, g, b] = rgb.map((v) => v / 255).map((v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  const seen = new Set();
  while (texts.nextNode()) {
    const element = texts.currentNode.parentElement;
    if (!texts.currentNode.textContent.trim() || seen.has(element) || !isShown(element) || element.matches("option,script")) continue;
    seen.add(element);
    const style = getComputedStyle(element);
    const under = behind(element);
    const [r, g, b, a] = rgba(style.color);
    const [light, dark] = [[r, g, b].map((v, k) => v * a + under[k] * (1 - a)), under].map(luminance).sort((x, y) => y - x);
    const contrast = (light + 0.05) / (dark + 0.05);
    const size = parseFloat(style.fontSize);
    const isLarge = size >= 24 || (size >= 18.66 && Number(style.fontWeight) >= 700);
    if (contrast < (isLarge ? 3 : 4.5)) wrong.push(`${told(element)} “${element.textContent.trim().slice(0, 30)}” has contrast ${contrast.toFixed(2)}`);
  }
  return wrong;
})()

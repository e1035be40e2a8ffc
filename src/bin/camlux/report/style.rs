//! The style sheet of the page for light and dark screens, and its script.

/// The style sheet. On dark screens the plots invert their lightness and keep their hues.
pub const STYLE: &str = "
:root { color-scheme: light dark; --ink: #222; --faint: #666; --paper: #fff; --line: #ddd; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #ddd; --faint: #999; --paper: #16181c; --line: #3a3d44; }
  svg { filter: invert(0.9) hue-rotate(180deg); }
}
body { max-width: 76rem; margin: 2rem auto; padding: 0 1rem; font: 16px/1.5 system-ui, sans-serif;
  color: var(--ink); background: var(--paper); }
h1, h2, h3 { line-height: 1.2; }
section { margin-top: 3rem; border-top: 1px solid var(--line); }
dl { display: flex; flex-wrap: wrap; gap: 0.5rem 2rem; }
dt { color: var(--faint); font-size: 0.8rem; }
dd { margin: 0; }
figure { margin: 1rem 0; }
figure svg { width: 100%; max-width: 920px; height: auto; display: block; }
figcaption { color: var(--faint); font-size: 0.9rem; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: 0.8rem; }
th, td { padding: 0.25rem 0.5rem; border-bottom: 1px solid var(--line); text-align: right; white-space: nowrap; }
th { font-weight: 600; }
tbody th, thead th:first-child { text-align: left; }
details { margin: 1rem 0; }
summary { cursor: pointer; }
.viewer { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(20rem, 100%), 1fr)); gap: 1.5rem; }
.viewer input { width: 100%; }
.scale { white-space: nowrap; }
.zoom { overflow: auto; max-height: 80vh; cursor: zoom-in; }
.zoom img { width: 100%; image-rendering: pixelated; display: block; }
.zoom.large { cursor: zoom-out; }
.zoom.large > * { width: 400%; max-width: none; }
.stack { display: grid; }
.stack > * { grid-area: 1 / 1; }
.over { clip-path: inset(0 calc(100% - var(--split, 50%)) 0 0); border: 0; }
.grid { display: flex; flex-wrap: wrap; gap: 1rem; }
.grid button { font: inherit; font-size: 0.85rem; color: inherit; background: none; border: 1px solid var(--line); border-radius: 6px;
  padding: 6px; cursor: pointer; text-align: left; }
.grid button:hover, .grid button:focus-visible { border-color: var(--faint); }
.grid img { width: 120px; margin-right: 4px; }
.grid span { display: block; }
img { height: auto; vertical-align: middle; }
";

/// A slider moves the edge between image and reference, a button chooses the image, a click enlarges it. The page shows everything without
/// scripts, too.
pub const SCRIPT: &str = "
for (const pictures of document.querySelectorAll('.pictures')) {
  const slider = pictures.querySelector('input'), over = pictures.querySelector('.over');
  slider.oninput = () => over.style.setProperty('--split', slider.value + '%');
  for (const button of pictures.querySelectorAll('button')) {
    button.onclick = () => {
      const [image, error] = button.querySelectorAll('img');
      over.querySelector('img').src = image.src;
      const shown = pictures.querySelector('.error img');
      if (shown && error) shown.src = error.src;
      pictures.querySelector('figcaption b').textContent = button.textContent.trim();
    };
  }
  for (const zoom of pictures.querySelectorAll('.zoom')) {
    zoom.onclick = (event) => {
      const box = zoom.getBoundingClientRect();
      const x = (event.clientX - box.left + zoom.scrollLeft) / zoom.scrollWidth;
      const y = (event.clientY - box.top + zoom.scrollTop) / zoom.scrollHeight;
      // The picture grows, the box stays.
      zoom.style.height = zoom.classList.toggle('large') ? box.height + 'px' : '';
      zoom.scrollTo(x * zoom.scrollWidth - box.width / 2, y * zoom.scrollHeight - box.height / 2);
    };
  }
}
";

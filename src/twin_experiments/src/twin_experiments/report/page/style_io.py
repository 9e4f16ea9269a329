"""How the page of a report looks: on phones and large screens, light and dark, and on paper."""

STYLE = """
:root { --ink: #1f2937; --soft: #566070; --paper: #ffffff; --line: #dfe3e8; --tint: #f4f6f8;
  --good: #15803d; --bad: #c81e3a; --link: #1a5fba; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e5e7eb; --soft: #a5adb8; --paper: #14161a; --line: #333842; --tint: #1c2026;
    --good: #4ade80; --bad: #fb7185; --link: #7db4ff; }
  img { filter: invert(0.92) hue-rotate(180deg); }
}
* { box-sizing: border-box; }
html { font-size: clamp(15px, 0.35vw + 12px, 20px); }
body { font: 1rem/1.5 system-ui, sans-serif; color: var(--ink); background: var(--paper);
  margin: 1.5rem auto; max-width: 76rem; padding: 0 1rem; }
h1 { margin: 0; font-size: 1.6rem; line-height: 1.25; }
h2 { margin: 2.4rem 0 0.5rem; border-bottom: 1px solid var(--line); }
h3 { margin: 1.4rem 0 0.3rem; font-size: 1rem; }
a { color: var(--link); }
p.soft, td.soft, figcaption { color: var(--soft); }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
th, td { text-align: left; padding: 0.3rem 0.9rem 0.3rem 0; vertical-align: top;
  border-bottom: 1px solid var(--line); }
th { color: var(--soft); font-weight: 600; }
.scroll { overflow-x: auto; }
.pass { color: var(--good); font-weight: 700; } .FAIL { color: var(--bad); font-weight: 700; }
.verdict { margin: 0.9rem 0; padding: 0.7rem 1rem; border-radius: 0.4rem; background: var(--tint);
  border-left: 0.5rem solid; font-size: 1.15rem; font-weight: 600; line-height: 1.4; }
.sentence { margin: 0.6rem 0; border-left: 0.3rem solid; padding-left: 0.8rem; }
.verdict, .sentence { color: var(--ink); }
.verdict.pass, .sentence.pass { border-color: var(--good); }
.verdict.FAIL, .sentence.FAIL { border-color: var(--bad); } .sentence { font-weight: 400; }
.label { margin: 1rem 0; } .label th { width: 8.5rem; } .label td { overflow-wrap: anywhere; }
.short td { white-space: nowrap; }
.contents ol { columns: 16rem; margin: 0.3rem 0; padding-left: 1.4rem; }
.contents a { display: inline-block; padding: 0.3rem 0; }
figure { margin: 1.4rem 0; overflow-x: auto; }
img { max-width: 100%; height: auto; display: block; }
.chart { width: 100%; }
.drawn > img { display: none; }
figure:not(.drawn) > .chart, figure:not(.drawn) .how { display: none; }
details { margin: 0.6rem 0; } summary { cursor: pointer; padding: 0.5rem 0; font-weight: 600; }
pre { overflow-x: auto; font-size: 0.85rem; }
@media screen and (max-width: 56rem) {
  .label th { width: 6rem; } th, td { padding-right: 0.6rem; } td { overflow-wrap: anywhere; }
  .stack table, .stack tbody, .stack tr, .stack td { display: block; }
  .stack tr { padding: 0.5rem 0; border-bottom: 1px solid var(--line); }
  .stack tr:first-child, .stack td:empty { display: none; }
  .stack td { display: flex; justify-content: space-between; gap: 1rem; border: 0; padding: 0;
    text-align: right; }
  .stack td::before { content: attr(data-heading); color: var(--soft); font-weight: 400;
    text-align: left; flex: none; }
  .stack td:first-child { font-weight: 600; } .stack td:first-child::before { content: none; } }
@page { size: A4; margin: 14mm; }
@media print {
  :root { --ink: #000; --soft: #444; --paper: #fff; --line: #bbb; --tint: #f2f2f2;
    --good: #15803d; --bad: #b01030; --link: #000; }
  html { font-size: 10.5px; } body { margin: 0; max-width: none; padding: 0; }
  img { filter: none; }
  .contents, .chart, .how, details:not(.printed) { display: none !important; }
  .drawn > img { display: block; }
  .scroll { overflow: visible; }
  section.experiment { break-before: page; }
  figure, tr, .verdict, .sentence { break-inside: avoid; } h2, h3 { break-after: avoid; }
  a { text-decoration: none; }
}
"""

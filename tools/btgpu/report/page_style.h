// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// The report's style sheet.
#pragma once

namespace btgpu::tool {

inline constexpr const char* kPageStyle = R"css(
:root { --page: #fff; --panel: #f6f7f9; --text: #1b1f24; --muted: #5d6673; --rule: #dfe3e8;
  --gpu: #d9480f; --stock: #74b3ee; --pass: #2b8a3e; --fail: #c92a2a; --pass-panel: #ebfbee; --fail-panel: #fff0f0 }
@media (prefers-color-scheme: dark) { :root { --page: #13161a; --panel: #1b1f25; --text: #e4e7eb; --muted: #98a2af;
  --rule: #2e343d; --gpu: #ff8a3d; --stock: #2f6db0; --pass: #69db7c; --fail: #ff8787; --pass-panel: #14261a;
  --fail-panel: #2f191b } .picture img { filter: brightness(.85) } }
* { box-sizing: border-box }
body { margin: 0; background: var(--page); color: var(--text); line-height: 1.5;
  font: 15px/1.5 system-ui, -apple-system, "Segoe UI", "Noto Sans", "Liberation Sans", sans-serif }
main { max-width: 1240px; margin: 0 auto; padding: 32px 24px 48px }
section { margin-top: 44px }
h1 { font-size: 30px; line-height: 1.2; font-weight: 650; margin: 0 0 14px; overflow-wrap: anywhere }
h2 { font-size: 19px; font-weight: 650; margin: 0 0 14px }
h3 { font-size: 15px; font-weight: 650; margin: 0 }
small, .note, .what, .meaning, footer, dt { color: var(--muted) }
small { font-size: 13px; font-weight: 400 }
.what { margin: 0; font-size: 14px }
.note { font-size: 13px; margin: 6px 0 0; max-width: 80ch }
.missing { color: var(--fail) }
.verdict { padding: 11px 16px; border-radius: 8px; margin: 0 0 20px; border-left: 4px solid; overflow-wrap: anywhere }
.verdict b { margin-right: 10px; font-weight: 650 }
.verdict.pass { border-color: var(--pass); background: var(--pass-panel) }
.verdict.fail { border-color: var(--fail); background: var(--fail-panel) }
.verdict.pass b { color: var(--pass) }
.verdict.fail b { color: var(--fail) }
dl { display: flex; flex-wrap: wrap; gap: 8px 36px; margin: 0 }
dt { font-size: 13px }
dd { margin: 0; overflow-wrap: anywhere; font-variant-numeric: tabular-nums }
figure { margin: 0; min-width: 0 }
.pictures, .plots { display: grid; gap: 20px }
.pictures { grid-template-columns: repeat(auto-fit, minmax(min(100%, 400px), 1fr)) }
.plots { grid-template-columns: repeat(auto-fill, minmax(min(100%, 360px), 1fr)) }
.picture { background: var(--panel); border-radius: 10px; overflow: hidden }
.picture img { display: block; width: 100%; height: auto }
.picture figcaption { padding: 8px 14px 10px; font-weight: 600; border-top: 1px solid var(--rule) }
.plot { background: var(--panel); border-radius: 10px; padding: 13px 14px 12px }
.plot svg { display: block; width: 100%; height: auto; margin-top: 4px }
.legend { margin: 2px 0 0; font-size: 13px; display: flex; flex-wrap: wrap; gap: 0 18px; color: var(--muted) }
.legend b { color: var(--text); font-weight: 500; font-variant-numeric: tabular-nums }
.key { display: inline-block; width: 16px; height: 3px; border-radius: 2px; margin: 0 7px 0 0; vertical-align: middle }
.key.gpu, .bar.gpu { background: var(--gpu) }
.key.stock, .bar.stock { background: var(--stock) }
.key.stock { height: 6px }
.grid { stroke: var(--rule); stroke-width: 1 }
.axis { stroke: var(--muted); stroke-width: 1 }
.tick { fill: var(--muted); font-size: 12px; font-variant-numeric: tabular-nums }
.line { fill: none; vector-effect: non-scaling-stroke; stroke-linejoin: round; stroke-linecap: round }
.line.gpu { stroke: var(--gpu); stroke-width: 2 }
.line.stock { stroke: var(--stock); stroke-width: 5 }
.dot.gpu { fill: var(--gpu); r: 3px }
.dot.stock { fill: var(--stock); r: 6px }
.scroll { overflow-x: auto }
table { border-collapse: collapse; width: 100%; margin-bottom: 20px }
th, td { text-align: left; padding: 6px 12px 6px 0; border-bottom: 1px solid var(--rule); vertical-align: top;
  font-weight: 400 }
thead th { color: var(--muted); font-size: 13px; white-space: nowrap }
code { font: 13px/1.6 ui-monospace, "SF Mono", "Liberation Mono", monospace; overflow-wrap: anywhere }
.meaning { display: block; font-size: 13px; max-width: 70ch }
.number { text-align: right; white-space: nowrap; font-variant-numeric: tabular-nums; padding-left: 12px }
sup { font-size: 70%; line-height: 0 }
.used { width: 110px; padding-left: 12px }
.gauge { display: block; height: 6px; margin-top: 9px; border-radius: 3px; background: var(--rule); overflow: hidden }
.gauge span { display: block; height: 100%; background: var(--pass) }
.fail .gauge span { background: var(--fail) }
.outcome { width: 50px; color: var(--pass); padding-right: 0; text-align: right }
tr.fail { background: var(--fail-panel) }
.fail .outcome, tr.fail .number { color: var(--fail); font-weight: 650 }
.bars { width: 50%; padding: 8px 0 8px 12px; vertical-align: middle }
.bar { display: block; height: 7px; min-width: 1px; border-radius: 2px }
.bar + .bar { margin-top: 3px }
.sum th, .sum td { font-weight: 650 }
footer { margin-top: 44px; font-size: 13px; overflow-wrap: anywhere }
@media (max-width: 600px) { main { padding: 20px 14px } .used { display: none } h1 { font-size: 24px } }
@media print { .plot, .picture, tr { break-inside: avoid } }
)css";

}  // namespace btgpu::tool

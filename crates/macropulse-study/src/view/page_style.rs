//! The look of the report: one column to read, charts as wide as they need, light and dark.

/// Style sheet of [`super::Page`].
pub(super) const STYLE: &str = r#":root{
  --paper:#fdfdfc;--panel:#f4f5f7;--ink:#1b2230;--soft:#5b6475;--rule:#e2e5ea;--accent:#2463b4;
  --holds:#12703f;--holds-bg:#e2f4e9;--partly:#8a5300;--partly-bg:#fcf0d8;--fails:#a8252b;--fails-bg:#fbe6e5;
  --sans:ui-sans-serif,system-ui,-apple-system,"Segoe UI",Roboto,Helvetica,Arial,sans-serif;
  --serif:Charter,"Bitstream Charter","Iowan Old Style","Source Serif 4",Georgia,Cambria,serif;
  --mono:ui-monospace,SFMono-Regular,Menlo,Consolas,"Liberation Mono",monospace;
  color-scheme:light dark}
@media screen and (prefers-color-scheme:dark){:root{
  --paper:#12151c;--panel:#1a1e27;--ink:#e6e9f0;--soft:#9aa3b4;--rule:#2a303c;--accent:#6aa5f8;
  --holds:#6fdca6;--holds-bg:#14301f;--partly:#f3bd6b;--partly-bg:#352610;--fails:#f79a96;--fails-bg:#3b191b}}
*{box-sizing:border-box}
html{scroll-behavior:smooth;-webkit-text-size-adjust:100%}
body{margin:0 auto;padding:0 1.25rem 4rem;max-width:62.5rem;background:var(--paper);color:var(--ink);
  font:1.0625rem/1.62 var(--serif);text-rendering:optimizeLegibility}
header,section>p,section>ul,section>h2,section>h3,section>aside,section>pre,footer{max-width:44rem}
header{padding:4.5rem 0 1.5rem}
.kicker{margin:0 0 .8rem;font:600 .8rem/1.3 var(--sans);letter-spacing:.09em;text-transform:uppercase;color:var(--accent)}
h1,h2,h3{font-family:var(--sans);text-wrap:balance;letter-spacing:-.012em}
h1{margin:0;font-size:clamp(2rem,5.2vw,3.1rem);line-height:1.1;letter-spacing:-.025em;font-weight:750}
.lead{margin:1.3rem 0 0;font-size:1.28rem;line-height:1.5;color:var(--soft)}
h2{margin:0 0 1rem;padding-top:2.6rem;font-size:1.65rem;line-height:1.2;font-weight:700}
h3{margin:2.2rem 0 .6rem;font-size:1.14rem;line-height:1.3;font-weight:650}
section+section{margin-top:2.2rem;border-top:1px solid var(--rule)}
main{counter-reset:s}section{scroll-margin-top:.5rem;counter-increment:s}
h2::before{content:counter(s);margin-right:.8rem;font-weight:400;color:var(--soft)}
p{margin:0 0 1.05rem;hyphens:manual;text-wrap:pretty}
ul{margin:0 0 1.05rem;padding-left:1.3rem}li{margin:.25rem 0}li::marker{color:var(--soft)}
code{font:.86em var(--mono);background:var(--panel);padding:.1em .32em;border-radius:.25rem}
pre{margin:1.2rem 0;padding:.9rem 1.1rem;overflow-x:auto;font:.84rem/1.5 var(--mono);background:var(--panel);border-radius:.5rem}
nav{margin:1rem 0 0;padding:1rem 0;border-block:1px solid var(--rule);font:.92rem/1.45 var(--sans)}
nav ol{margin:0;padding:0;list-style:none;display:grid;grid-template-columns:repeat(auto-fill,minmax(15rem,1fr));gap:.15rem 2rem;counter-reset:n}
nav li{margin:0;counter-increment:n}
nav a{display:block;padding:.22rem 0;color:var(--ink);text-decoration:none}
nav a::before{content:counter(n);display:inline-block;width:1.7rem;color:var(--soft);font-variant-numeric:tabular-nums}
nav a:hover,nav a:focus-visible{color:var(--accent);text-decoration:underline;text-underline-offset:.2em}
figure{margin:1.9rem 0}
figure>img,.chart>svg{display:block;max-width:100%;height:auto}
figure>img{border-radius:.4rem}img.wide{width:100%}
@media (max-width:40rem){.chart{overflow-x:auto}.chart>svg{max-width:none;width:auto;height:auto;min-width:38rem}}
figcaption{margin-top:.65rem;max-width:44rem;font:.88rem/1.5 var(--sans);color:var(--soft)}
figcaption strong{color:var(--ink)}
.gallery{display:grid;gap:1.3rem;margin:1.9rem 0;align-items:start}
.gallery figure{margin:0;min-width:0}.gallery img{width:100%}
@media (min-width:46rem){.across-2,.across-4{grid-template-columns:repeat(2,1fr)}.across-3,.across-5,.across-6{grid-template-columns:repeat(3,1fr)}}
@media (min-width:64rem){.across-4{grid-template-columns:repeat(4,1fr)}.across-5{grid-template-columns:repeat(5,1fr)}.across-6{grid-template-columns:repeat(6,1fr)}}
.table{margin:1.9rem 0;overflow-x:auto}
table{border-collapse:collapse;min-width:min(100%,30rem);font:.92rem/1.45 var(--sans);font-variant-numeric:tabular-nums lining-nums}
caption{padding-bottom:.6rem;text-align:left;font-weight:600}
th{padding:.45rem .9rem;text-align:left;vertical-align:bottom;font-weight:600;font-size:.84rem;color:var(--soft);border-bottom:1.5px solid var(--soft)}
td{padding:.5rem .9rem;vertical-align:top;border-bottom:1px solid var(--rule)}
th:first-child,td:first-child{padding-left:0}
.dense table{font-size:.76rem}
.dense th,.dense td{padding:.16rem .3rem;font-size:.76rem}
tbody tr:hover td{background:var(--panel)}
.number{text-align:right;white-space:nowrap}
.verdict span{display:inline-block;padding:.06rem .6rem;border-radius:1rem;font-weight:600;font-size:.84rem;white-space:nowrap}
.holds span{color:var(--holds);background:var(--holds-bg)}
.partly span{color:var(--partly);background:var(--partly-bg)}
.fails span{color:var(--fails);background:var(--fails-bg)}
aside{margin:1.6rem 0;padding:.95rem 1.2rem;border-left:3px solid var(--accent);border-radius:0 .4rem .4rem 0;background:var(--panel);font:.96rem/1.55 var(--sans)}
aside p{margin:.3rem 0 0}
aside.caution{border-color:var(--partly);background:var(--partly-bg)}
aside.finding{border-color:var(--holds);background:var(--holds-bg)}
.numbers{display:grid;grid-template-columns:repeat(auto-fit,minmax(9.5rem,1fr));gap:1.4rem 2rem;margin:2rem 0}
.numbers div{display:flex;flex-direction:column-reverse;justify-content:flex-end;padding-top:.7rem;border-top:2px solid var(--accent)}
.numbers dd{margin:0;font:700 1.75rem/1.15 var(--sans);letter-spacing:-.02em;font-variant-numeric:tabular-nums}
.numbers dt{margin-top:.3rem;font:.86rem/1.4 var(--sans);color:var(--soft)}
footer{margin-top:4rem;padding-top:1.2rem;border-top:1px solid var(--rule);font:.86rem/1.5 var(--sans);color:var(--soft)}
@media print{
  body{max-width:none;padding:0;font-size:10.5pt}header{padding-top:0}nav{display:none}
  h2,h3{break-after:avoid}figure,table,aside{break-inside:avoid}
  figure>img,.verdict span,aside{print-color-adjust:exact;-webkit-print-color-adjust:exact}}
"#;

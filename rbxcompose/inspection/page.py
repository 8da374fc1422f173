"""What all HTML pages of graphs share: the style, and what happens when the pointer is over a box."""

STYLE = """
:root{--page:#fff;--text:#1f2328;--soft:#59636e;--edge:#d0d7de;--group:#f6f8fa;--body:#fff;
--topic:#0969da;--service:#1a7f37;--action:#8250df;--look:#818b98;--mux:#bc4c00}
@media(prefers-color-scheme:dark){:root{--page:#0d1117;--text:#e6edf3;--soft:#9198a1;--edge:#3d444d;--group:#151b23;
--body:#212830;--topic:#4493f8;--service:#3fb950;--action:#ab7df8;--look:#818b98;--mux:#f0883e}}
*{box-sizing:border-box}body{margin:0;padding:20px 24px;background:var(--page);color:var(--text);
font:14px/1.45 system-ui,sans-serif}
h1{margin:0;font-size:22px}h2{font-size:16px;margin:24px 0 8px}header p{margin:2px 0 10px;color:var(--soft)}
.legend{display:flex;flex-wrap:wrap;gap:6px 18px;align-items:center;margin-bottom:12px;color:var(--soft)}
.legend label,.legend span{display:flex;gap:6px;align-items:center}.legend label{cursor:pointer}
.legend input{margin:0}.sample{width:20px;height:13px;border:1.5px solid var(--soft);border-radius:4px}
.sample.mux{border:3px double var(--mux);border-radius:1px}.sample.mission{border-color:var(--action);border-radius:7px}
.sample.group{background:var(--group);border:1px solid var(--edge)}
.picture{overflow:auto;border:1px solid var(--edge);border-radius:8px;padding:6px}
.picture svg.graph{display:block;margin:auto}
svg text{font:12px system-ui,sans-serif;fill:var(--text);text-anchor:middle}
svg text.name{font-weight:600;font-size:13px}svg text.type{font-size:11px;fill:var(--soft)}
svg text.topic{font-size:11.5px}svg text.process{text-anchor:start;fill:var(--soft);font-weight:600}
.group{fill:var(--group);stroke:var(--edge)}.body{fill:var(--body);stroke:var(--soft);stroke-width:1.3}
.mux .body,.mux .inner{stroke:var(--mux)}.inner{fill:none;stroke-width:1}.mission .body{stroke:var(--action)}
.pill{fill:var(--page);stroke:var(--edge)}.open .pill{stroke-dasharray:4 3}
.line{fill:none;stroke-width:1.5}.run{stroke:var(--soft)}
.topic .pill{stroke:var(--topic)}.service .pill{stroke:var(--service)}.action .pill{stroke:var(--action)}
.look-up .pill{stroke:var(--look)}
.line.topic{stroke:var(--topic)}.line.service{stroke:var(--service);stroke-dasharray:7 4}
.line.action{stroke:var(--action);stroke-width:2.6}.line.look-up{stroke:var(--look);stroke-dasharray:1.5 4}
.box{cursor:pointer;outline:none}.box:focus .body{stroke-width:2.6}
.faded .wire:not(.near),.faded .box:not(.near),.faded .run:not(.near){opacity:.13}
.hidden{display:none}
table{border-collapse:collapse;display:block;overflow-x:auto}
th,td{text-align:left;padding:3px 14px 3px 0;border-bottom:1px solid var(--edge);vertical-align:top}
th{color:var(--soft);font-weight:600}td{overflow-wrap:anywhere}
"""

SCRIPT = """
const graph=document.querySelector("svg.graph"),all=s=>[...document.querySelectorAll(s)];
const boxesOf=e=>(e.dataset.boxes||"").split(" ");let held=null;
function show(key){graph.classList.toggle("faded",!!key);const near=new Set([key]);
for(const e of all(".wire,.line.run")){const on=boxesOf(e).includes(key);e.classList.toggle("near",on);
if(on)boxesOf(e).forEach(k=>near.add(k))}
for(const e of all(".box"))e.classList.toggle("near",near.has(e.dataset.box))}
for(const e of all(".box")){e.onpointerenter=()=>held||show(e.dataset.box);e.onpointerleave=()=>held||show(null);
e.onclick=()=>{held=held===e.dataset.box?null:e.dataset.box;show(held)};
e.onkeydown=k=>{if(k.key==="Enter")e.onclick()}}
for(const e of all("input[data-kind]"))e.onchange=()=>{
for(const w of all(`.wire[data-kind="${e.dataset.kind}"],tr[data-kind="${e.dataset.kind}"]`))
w.classList.toggle("hidden",!e.checked)};
"""

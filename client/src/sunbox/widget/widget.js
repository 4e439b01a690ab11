// Written by client/bundle.py from web/widget/ and what it imports.
const lib_dom = (() => {
let counter=0;
const freshId = (stem) => `${stem}-${++counter}`;
const beginIds=(at)=>{
counter=at;
};
function element(tag,attributes={},...children){
const node=document.createElement(tag);
for(const [name,value] of Object.entries(attributes)){
if(name.startsWith("on"))node.addEventListener(name.slice(2),value);
else if(typeof value==="boolean")node.toggleAttribute(name,value);
else if(value !==undefined)node.setAttribute(name,value);
}
node.append(...children.filter((child)=>child !==null&&child !==undefined));
return node;
}
const isBeingEdited=(input)=>document.activeElement===input&&input.dataset.dirty==="yes";
return { beginIds, element, freshId, isBeingEdited };
})();
const lib_format_text = (() => {
const UNITS = { degrees: "°", um: "µm", "W/(m^2 sr)": "W/(m² sr)", "W/m^2": "W/m²", "cd/m^2": "cd/m²" };
const NAMES={
aces:"ACES",
aces2:"ACES 2",
agx:"AgX",
pbr_neutral:"PBR neutral",
mis:"MIS",
bsdf:"BSDF",
blackman_harris:"Blackman\u2013Harris",
ggx:"GGX",
gtr:"GTR",
abc:"ABC",
sgd:"SGD",
eon:"EON",
oren_nayar:"Oren\u2013Nayar",
cook_torrance:"Cook\u2013Torrance",
schlick_ggx:"Schlick\u2013GGX",
color:"Colour",
uv:"UV",
shape_id:"Shapes",
material_id:"Materials",
};
const unitText=(unit)=>UNITS[unit] ?? unit;
function inWords(name){
const spaced = name.replaceAll(/[_-]/g, " ");
return NAMES[name] ?? spaced.charAt(0).toUpperCase()+ spaced.slice(1);
}
const compact=(value)=>
[value]
.flat()
.map((each)=>String(Number(each.toPrecision(4))))
.join(", ");
const NARROW=7;
function narrow(value,most){
if(Math.abs(value)<1e-6 * most)return "0";
const texts=[
...[4,3].map((digits)=>String(Number(value.toPrecision(digits)))),
...[2,1].map((digits)=>value.toExponential(digits)),
];
return texts.find((text)=>text.length<=NARROW)?? texts.at(-1);
}
const percent = (ratio) => `${Number((100 * ratio).toPrecision(2))}\u00a0%`;
const amount = (n, thing) => `${count(n)} ${thing}${n === 1 ? "" : "s"}`;
const count=(n)=>n.toLocaleString("en").replaceAll(",","\u202f");
return { amount, compact, count, inWords, narrow, percent, unitText };
})();
const lib_patch = (() => {
const isObject=(value)=>value !==null&&typeof value==="object"&&!Array.isArray(value);
function equal(a,b){
if(a===b)return true;
if(a===null||b===null||typeof a !=="object"||typeof b !=="object")return false;
if(Array.isArray(a)!==Array.isArray(b))return false;
const keys=Object.keys(a);
return keys.length===Object.keys(b).length&&keys.every((key)=>key in b&&equal(a[key],b[key]));
}
const changesType=(from,to)=>
from.type !==to.type&&[from.type,to.type].every((kind)=>kind===undefined||typeof kind==="string");
function diff(from,to){
if(from===to)return undefined;
if(!isObject(from)||!isObject(to)||changesType(from,to))return equal(from,to)? undefined:to;
const patch={};
for(const key of Object.keys(from))if(to[key]===undefined)patch[key]=null;
for(const [key,value] of Object.entries(to)){
const change=value===undefined ? undefined:diff(from[key],value);
if(change !==undefined)patch[key]=change;
}
return Object.keys(patch).length ? patch:undefined;
}
const parts=(pointer)=>
pointer
.split("/")
.slice(1)
.map((part) => part.replaceAll("~1", "/").replaceAll("~0", "~"));
const pointer=(...keys)=>
keys.map((key) => `/${String(key).replaceAll("~", "~0").replaceAll("/", "~1")}`).join("");
function put(document,place,value){
const set=(node,[key,...rest])=>{
if(key===undefined)return value;
const copy=Array.isArray(node)? [...node]:{...node};
const child=set(copy[key],rest);
if(child===undefined&&!Array.isArray(copy))delete copy[key];
else copy[key]=child;
return copy;
};
return set(document,parts(place));
}
return { diff, equal, isObject, pointer, put };
})();
const server_schema = (() => {
function resolve(schema,node){
if(!node?.$ref)return node ??{};
const target=node.$ref
.split("/")
.slice(1)
.reduce((place,key)=>place[key],schema);
const{$ref,...beside}=node;
return{...resolve(schema,target),...beside};
}
const branches=(schema,node)=>{
const options=node.anyOf ?? node.oneOf;
return options
? options.map((option)=>resolve(schema,option)).filter((option)=>option.type !=="null")
:[node];
};
function property(schema,model,name){
return resolve(schema,resolve(schema,model).properties[name]);
}
function variants(schema,union){
const found={};
const visit=(node)=>{
const kind=node.properties?.type;
if(kind)found[kind.const ?? kind.enum?.[0] ?? kind.default]=node;
else if(node.anyOf||node.oneOf)branches(schema,node).forEach(visit);
};
visit(resolve(schema,union));
return found;
}
const model=(schema,owner,name)=>
branches(schema,property(schema,owner,name)).find((node)=>node.properties);
const materialModels=(schema)=>
variants(schema,property(schema,schema,"materials").additionalProperties);
const cameraModels=(schema)=>variants(schema,property(schema,schema,"camera"));
const bound=(nodes,key)=>nodes.map((node)=>node[key]).find((value)=>value !==undefined);
function step(min,max,whole){
if(whole)return 1;
return Number.isFinite(max - min) ? 10 ** Math.ceil(Math.log10((max - min) / 500)) : 0.01;
}
function field(schema,name,raw,required){
const top=resolve(schema,raw);
const options=branches(schema,top);
const nodes=[top,...options];
const color=bound(nodes,"x-widget")==="color";
const numeric=options.find((node)=>["number","integer"].includes(node.type));
const vector=
!color&&
options.find((node)=>node.type==="array"&&[2,3].includes(node.maxItems)&&node.items?.type==="number");
const reference=options.find((node)=>node.properties?.texture);
const whole=!options.some((node)=>node.type==="number");
const limits=[top,...(numeric ? [numeric]:[])];
const choices=bound(nodes,"enum");
const pair=choices&&options.find((node)=>node.type==="array"&&node.maxItems===2&&node.items?.enum);
const open={min:bound(limits,"exclusiveMinimum"),max:bound(limits,"exclusiveMaximum")};
const min=bound(limits,"minimum")?? open.min;
const max=bound(limits,"maximum")?? open.max;
const soft={min:bound(nodes,"x-soft-minimum")?? min,max:bound(nodes,"x-soft-maximum")?? max};
const file=bound(nodes,"x-asset");
const usual=color
? "color"
:vector
? "vector"
:choices
?(pair&&"choices")||"choice"
:options.some((node)=>node.type==="boolean")
? "toggle"
:numeric
?(bound(nodes,"x-widget")?? "number")
:reference
? "texture"
:bound(nodes,"x-widget")==="text"
? "text"
:null;
const log=bound(nodes,"x-log");
const widget=file ? "file":log ?(color ? "amounts":"amount"):usual;
if(!widget||bound(nodes,"const")!==undefined)return null;
return{
name,
widget,
file,
choices,
min,
max,
open,
required,
takesTexture:reference !==undefined,
reference,
length:vector?.maxItems,
title:top.title ?? name,
group:bound(nodes,"x-group"),
hint:bound(nodes,"description")?? "",
unit:bound(nodes,"x-unit")?? "",
soft:log&&soft.min===open.min ?{...soft,min:log}:soft,
log,
step:step(soft.min,soft.max,whole&&!color),
whole,
initial:top.default ?? undefined,
absent:bound(nodes,"x-absent"),
follows:bound(nodes,"x-follows"),
ranges:bound(nodes,"x-ranges"),
used:bound(nodes,"x-used"),
unless:bound(nodes,"x-unless"),
beside:bound(nodes,"x-beside"),
example:bound(nodes,"examples")?.[0],
isPerChannel:Boolean(vector&&numeric&&bound(nodes,"x-group")),
};
}
function fields(schema,owner){
const{properties={},required=[]}=resolve(schema,owner);
return Object.entries(properties)
.map(([name,raw])=>field(schema,name,raw,required.includes(name)))
.filter((found)=>found !==null);
}
function followed({follows},value){
if(!follows||typeof value !=="number")return undefined;
const{points}=follows;
const to=Math.max(
1,
points.findIndex(([x])=>x>=value),
);
const [[x0,y0],[x1,y1]]=[points[to - 1],points[to]];
return Number((y0 + ((y1 - y0) * (value - x0)) / (x1 - x0)).toPrecision(3));
}
function defaults(schema,owner,names=Object.keys(owner.properties)){
const known=names.map((name)=>[name,property(schema,owner,name).default]);
return Object.fromEntries(known.filter(([,value])=>value !==undefined&&value !==null));
}
return { cameraModels, defaults, fields, followed, materialModels, model, property, variants };
})();
const lib_color = (() => {
const toSrgb = (x) => (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);
const toLinear = (x) => (x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4);
const HEX = /^#?([0-9a-f]{6})$/i;
const LUMINANCE=[0.2126,0.7152,0.0722];
function planck(t){
const u = (0.86012 + 1.5412e-4 * t + 1.2864e-7 * t * t) / (1 + 8.4242e-4 * t + 7.0815e-7 * t * t);
const v = (0.3174 + 4.2281e-5 * t + 4.2048e-8 * t * t) / (1 - 2.8974e-5 * t + 1.6146e-7 * t * t);
const [x, z] = [(1.5 * u) / v, (2 - 0.5 * u - 5 * v) / v];
const color=[3.24 * x - 1.537 - 0.4985 * z,1.876 - 0.969 * x + 0.0416 * z,0.0556 * x - 0.204 + 1.057 * z];
return ofLuminance(
color.map((channel)=>Math.max(channel,0)),
1,
);
}
function ofLuminance(color,luminance){
const own=color.reduce((sum,x,i)=>sum + LUMINANCE[i] * x,0);
return color.map((x) => (x * luminance) / own);
}
const WORDS={kelvin:"K",candela:"cd",lumen:"lm",lux:"lx",nit:"nt"};
const unitOf=(color)=>Object.keys(WORDS).find((each)=>color?.[each] !==undefined);
function measureWords(color){
const unit=unitOf(color);
return unit ? `${color[unit]} ${WORDS[unit]}` : null;
}
function linear(color){
if(typeof color==="number")return [color,color,color];
const unit=unitOf(color);
if(unit==="kelvin")return planck(color.kelvin);
if (unit) return ofLuminance(linear(color.color ?? 1), color[unit] / (unit === "lumen" ? 8583 : 683));
if(typeof color !=="string")return color;
const bits=parseInt(HEX.exec(color)[1],16);
return [bits >> 16, (bits >> 8) & 255, bits & 255].map((byte) => toLinear(byte / 255));
}
function parseColor(text){
const plain=text.trim();
const kelvin = Number(/^(\d{4,5}) ?K$/i.exec(plain)?.[1]);
if(kelvin>=1000&&kelvin<=40000){
const warm=planck(kelvin);
return warm.map((x) => x / Math.max(...warm));
}
const wanted = /^([0-9a-f]{3}|[0-9a-f]{6})$/i.test(plain) ? `#${plain}` : plain;
const context=new OffscreenCanvas(1,1).getContext("2d");
const [found,other]=["#000000","#ffffff"].map((before)=>{
context.fillStyle=before;
context.fillStyle=wanted;
return context.fillStyle;
});
return found===other&&HEX.test(found)? linear(found):null;
}
const hex=(color)=>
"#" +
color
.map((x)=>
Math.round(255 * toSrgb(Math.min(Math.max(x,0),1)))
.toString(16)
.padStart(2,"0"),
)
.join("");
return { HEX, hex, linear, measureWords, parseColor, toLinear, toSrgb };
})();
const lib_number = (() => {
const TOKEN = /\s*(?:((?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?)(?:\s*([^\s\d.+*/()-]+))?|([-+*/()]))/giy;
const UNITS={
m:{km:1000,cm:0.01,mm:0.001,µm:1e-6,nm:1e-9,in:0.0254,ft:0.3048},
"°": { deg: 1, rad: 180 / Math.PI },
s:{ms:0.001,min:60,h:3600},
pixels:{px:1},
};
function tokens(text,unit){
const factors={...UNITS[unit],...(unit ?{[unit]:1}:{"%":0.01})};
const found=[];
TOKEN.lastIndex=0;
while(TOKEN.lastIndex<text.length){
const match=TOKEN.exec(text);
if(!match)return null;
const [,digits,own,sign]=match;
if(own&&!Object.hasOwn(factors,own))return null;
found.push(sign ?? Number(digits)*(own ? factors[own]:1));
}
return found;
}
function calculate(rest){
const factor=()=>{
const next=rest.shift();
if(next==="-")return -factor();
if(next==="+")return factor();
if(next !=="(")return typeof next==="number" ? next:NaN;
const inside=sum();
return rest.shift()===")" ? inside:NaN;
};
const product=()=>{
let value=factor();
while (rest[0] === "*" || rest[0] === "/") value = rest.shift() === "*" ? value * factor() : value / factor();
return value;
};
const sum=()=>{
let value=product();
while(rest[0]==="+"||rest[0]==="-")value=rest.shift()==="+" ? value + product():value - product();
return value;
};
const value=sum();
return rest.length ? NaN:value;
}
function parseNumber(text,unit=""){
let plain=text.trim().replaceAll("\u2212","-");
if(unit&&!UNITS[unit]&&plain.endsWith(unit))plain=plain.slice(0,-unit.length).trimEnd();
if(plain.includes(",")&&plain.includes("."))return null;
const found = tokens(plain.replaceAll(",", ".").replaceAll(/(?<=\d)[\s\u202f](?=\d{3}(?!\d))/g, ""), unit);
const value=found?.length ? calculate(found):NaN;
return Number.isFinite(value)? Number(value.toPrecision(12)):null;
}
function parseTriple(text){
const apart = text.trim().split(/[\s;]+/);
const parts = apart.length === 1 ? apart[0].split(",") : apart.map((part) => part.replace(/,$/, ""));
const numbers=parts.map((part)=>parseNumber(part));
return numbers.length===3&&numbers.every((number)=>number !==null)? numbers:null;
}
const NEEDED = "A number is needed here, such as 0.5, 0,5, 1/3 or 50%.";
const neededIn = (unit) => (unit ? `A number is needed here, in ${unit}, such as 0.5, 0,5 or 1/3.` : NEEDED);
return { NEEDED, neededIn, parseNumber, parseTriple };
})();
const lib_lengths = (() => {
const { parseNumber } = lib_number;
const UNITS=[
{from:1,unit:"m",metres:1},
{from:0.1,unit:"cm",metres:0.01},
{from:1e-5,unit:"mm",metres:0.001},
{from:0,unit:"µm",metres:1e-6},
];
const USUAL=UNITS[2];
const unitFor=(length)=>(length ? UNITS.find(({from})=>Math.abs(length)>=from *(1 - 1e-9)):USUAL);
const LENGTH_NEEDED = "A length is needed here, such as 26 mm, 2.5 cm or 1/8 in.";
function lengthWords(length){
const{unit,metres}=unitFor(length);
return `${Number((length / metres).toPrecision(3))} ${unit}`;
}
const LAST = /^([^a-zµ]*)([a-zµ]+)$/i;
function parseLength(text,before=null){
const plain=text.trim();
const [,sum,unit]=LAST.exec(plain)?? [];
if (!unit && /[a-zµ]/i.test(plain)) return parseNumber(plain, "m");
const metres = unit ? parseNumber(`1 ${unit}`, "m") : unitFor(before).metres;
const value=parseNumber(sum ?? plain,"1");
return value===null||metres===null ? null:Number((value * metres).toPrecision(12));
}
return { LENGTH_NEEDED, lengthWords, parseLength };
})();
const lib_sliding = (() => {
const STILL=6;
const GLIDE_MS=100;
let scrolled=-Infinity;
document.addEventListener(
"scroll",
()=>{
scrolled=performance.now();
},
{capture:true,passive:true},
);
function slideByTouch(range,{input,commit}){
let finger=null;
const set=(from,pixels)=>{
const [min,max]=[Number(range.min),Number(range.max)];
range.value = String(from + (pixels / range.clientWidth) * (max - min));
input(range.valueAsNumber);
};
range.addEventListener(
"input",
(event)=>{
if(!finger)return;
event.stopImmediatePropagation();
range.value=String(finger.value);
},
{capture:true},
);
range.addEventListener("pointerdown",({pointerType,pointerId:id,clientX:x,clientY:y})=>{
if(pointerType !=="touch"||finger)return;
const value=range.valueAsNumber;
finger={id,x,y,from:value,value,isSliding:false,isTap:performance.now()- scrolled>GLIDE_MS};
});
range.addEventListener("pointermove",({pointerId,clientX,clientY})=>{
if(pointerId !==finger?.id)return;
const [right,down]=[Math.abs(clientX - finger.x),Math.abs(clientY - finger.y)];
if(right>STILL||down>STILL)finger.isTap=false;
if(!finger.isSliding&&right>STILL&&right>down)Object.assign(finger,{isSliding:true,x:clientX});
if(!finger.isSliding)return;
set(finger.from,clientX - finger.x);
finger.value=range.valueAsNumber;
});
const lift=({pointerId,type})=>{
if(pointerId !==finger?.id)return;
const{x,isSliding,isTap}=finger;
finger=null;
const isTapped=isTap&&type==="pointerup";
if(isTapped)set(Number(range.min),x - range.getBoundingClientRect().left);
if(isTapped||isSliding)commit();
};
range.addEventListener("pointerup",lift);
range.addEventListener("pointercancel",lift);
}
return { slideByTouch };
})();
const lib_span = (() => {
const FAR=90;
const STEPS=1000;
const DIGITS=3;
const ZERO=0.03;
function span({min,max},step,mayBeLog,log){
if(log>0&&min<=log)return decades({min,max},log);
const isLog=mayBeLog&&(min>0 ? max>FAR * min:min===0&&max>FAR);
if(!isLog)return{min,max,isLog,step,stepAt:()=>step};
const [low, range] = min > 0 ? [Math.log(min), Math.log(max / min)] : [0, Math.log1p(max)];
const inside=(value)=>Math.min(Math.max(value,min),max);
return{
min,
max,
isLog,
step: 1 / STEPS,
toShare: (value) => ((min > 0 ? Math.log(inside(value)) : Math.log1p(inside(value))) - low) / range,
fromShare:(share)=>
inside(Number((min>0 ? Math.exp(low + share * range):Math.expm1(share * range)).toPrecision(DIGITS))),
stepAt:(value)=>tenth(Math.max(Math.abs(value),min,1e-3)),
};
}
const tenth=(value)=>10 **(Math.floor(Math.log10(value)+ 1e-9)- 1);
function decades({min,max},log){
const zero=min<log ? ZERO:0;
const low=zero ? log:min;
const range = Math.log(max / low);
const inside=(value)=>Math.min(Math.max(value,low),max);
return{
min,
max,
isLog:true,
step: 1 / STEPS,
toShare: (value) => (zero && value < low / 2 ? 0 : zero + ((1 - zero) * Math.log(inside(value) / low)) / range),
fromShare:(share)=>
share < zero / 2
? min
: inside(Number((low * Math.exp((Math.max(0, share - zero) / (1 - zero)) * range)).toPrecision(DIGITS))),
stepAt:(value)=>tenth(Math.max(Math.abs(value),low)),
};
}
function endsOf({ranges,soft},choice){
const own=ranges?.bounds[choice];
return own ?{min:own[0],max:own[1]}:soft;
}
return { endsOf, span };
})();
const forms_number_controls = (() => {
const { element, isBeingEdited } = lib_dom;
const { slideByTouch } = lib_sliding;
const { neededIn, parseNumber } = lib_number;
const { compact, unitText } = lib_format_text;
const { span } = lib_span;
const UNSET="–";
const ROOM={narrow:7,wide:20};
const placeholder=({absent=UNSET},room)=>(absent.length>ROOM[room] ? "auto":absent);
const withUnit = (field, value) => `${compact(value)} ${unitText(field.unit)}`.trim();
const wordsOf=(field)=>field.words ?? field.write ??((value)=>withUnit(field,value));
const scaleOf=(field,ends=field.soft)=>span(ends,field.step,Boolean(field.ranges),field.log);
function numberEntry(field,id,{input,commit,refuse,restore},room="narrow"){
const unit=unitText(field.unit);
const{write=compact,read=(text)=>parseNumber(text,unit),needed=neededIn(unit)}=field;
const words=wordsOf(field);
let latest=null;
let holds=null;
let scale=scaleOf(field);
const clean=()=>{
delete box.dataset.dirty;
};
const take=()=>{
clean();
if(box.value.trim()===""){
if(field.required)return restore();
input(undefined);
return commit();
}
const value=read(box.value,holds);
if(value===null)return refuse(needed);
input(value);
commit();
};
const now=()=>
[read(box.value,holds),latest,read(box.placeholder,holds),field.initial,field.soft.min,0].find(
(each)=>typeof each==="number",
);
const{min=-Infinity,max=Infinity,open}=field;
const give=(value)=>{
const to=Number(value.toPrecision(12));
if(to<min||to>max||to<=open.min||to>=open.max)return;
clean();
input(to);
box.value=write(to);
};
const step=(steps)=>{
const from=now();
give(from + steps * scale.stepAt(from));
box.select();
};
let begun=null;
const drag={
begin:()=>{
begun={latest,from:latest ?? now()};
},
move:(steps)=>{
const size=scale.stepAt(begun.from);
const to = Math.round(begun.from / size + steps) * size;
give(Math.min(Math.max(to,min),max));
},
end:commit,
cancel:()=>{
input(begun.latest ?? undefined);
commit();
},
};
const box=element("input",{
type:"text",
id,
class:"entry number",
autocomplete:"off",
spellcheck:"false",
inputmode:field.min>=0&&!field.write ? "decimal":undefined,
oninput:()=>{
box.dataset.dirty="yes";
},
onblur:clean,
onkeydown:(event)=>{
if(event.key==="Escape"){
clean();
restore();
}
const up={ArrowUp:1,ArrowDown:-1}[event.key];
if(!up||event.altKey||event.ctrlKey||event.metaKey)return;
event.preventDefault();
step(up *(event.shiftKey ? 10:1));
},
onkeyup:({key})=>{
if(key==="ArrowUp"||key==="ArrowDown")commit();
},
onchange:take,
});
const show=(value,effective,ends=field.soft)=>{
latest=value ?? null;
scale=scaleOf(field,ends);
box.placeholder=effective===undefined ? placeholder(field,room):write(effective);
holds=latest ?? effective ?? null;
if(typeof holds==="number"){
box.setAttribute("role","spinbutton");
box.setAttribute("aria-valuenow",String(holds));
box.setAttribute("aria-valuetext",words(holds));
}else ["role","aria-valuenow","aria-valuetext"].forEach((name)=>box.removeAttribute(name));
if(isBeingEdited(box))return;
box.value=latest===null ? "":write(latest);
if(latest===null)box.title=effective===undefined ?(field.absent ?? ""):"";
else box.title=box.value===String(latest)? "":String(latest);
};
return{element:box,show,drag};
}
function track(field,id,{input,commit}){
let scale=null;
const inside=(at)=>{
const value=scale.isLog ? scale.fromShare(at):at;
if(value<=field.open.min)return field.open.min + field.step;
return value>=field.open.max ? field.open.max - field.step:value;
};
const words=wordsOf(field);
const range=element("input",{
type:"range",
id,
oninput:()=>input(inside(range.valueAsNumber)),
onchange:commit,
});
const over=(ends)=>{
if(scale&&ends.min===scale.min&&ends.max===scale.max)return;
scale=scaleOf(field,ends);
const [min,max]=scale.isLog ? [0,1]:[ends.min,ends.max];
Object.assign(range,{min:String(min),max:String(max),step:String(scale.step)});
};
over(field.soft);
slideByTouch(range,{input:(value)=>input(inside(value)),commit});
const show=(value,effective,ends=field.soft)=>{
over(ends);
const [min,max]=[Number(range.min),Number(range.max)];
const known=value ?? effective ?? null;
range.classList.toggle("ghost",(value ?? null)===null);
range.classList.toggle("unset",known===null);
range.value=String(known===null ? min:scale.isLog ? scale.toShare(known):known);
range.style.setProperty("--share", String((range.valueAsNumber - min) / (max - min)));
const number=known===null ?(field.absent ?? ""):words(known);
const told=(value ?? null)!==null ? number:["not set",number].filter(Boolean).join(", ");
range.setAttribute("aria-valuetext",told);
};
return{element:range,show};
}
function slider(field,id,events){
const range=track(field,id,events);
const entry = numberEntry(field, `${id}-entry`, events);
entry.element.setAttribute("aria-label", `${field.title}, number`);
return{
element:element("div",{class:"slider"},range.element,entry.element),
drag:entry.drag,
show(value,effective,ends){
range.show(value,effective,ends);
entry.show(value,effective,ends);
},
};
}
return { UNSET, numberEntry, placeholder, scaleOf, slider, track, withUnit };
})();
const forms_amounts = (() => {
const { linear } = lib_color;
const { element } = lib_dom;
const { compact, unitText } = lib_format_text;
const { LENGTH_NEEDED, lengthWords, parseLength } = lib_lengths;
const { slider } = forms_number_controls;
const CHANNELS=["Red","Green","Blue"];
const SHARE={unit:"",min:0,max:1,soft:{min:0,max:1},open:{},step:0.01,initial:undefined};
const exact=(x)=>Number(x.toPrecision(4));
const inPercent={
write: (share) => `${Number((100 * share).toPrecision(3))}\u00a0%`,
read:(text)=>parseShare(text),
needed:"A share is needed here, such as 40 %.",
};
function parseShare(text){
const value = Number(text.replace(/\s*%\s*$/, "").replace(",", "."));
return text.trim() && value >= 0 && value <= 100 ? value / 100 : null;
}
const isLength=({widget,unit})=>["amount","amounts"].includes(widget)&&unit==="m";
const amountWords=(field,value)=>{
const most=Math.max(...linear(value));
return field.unit === "m" ? lengthWords(most) : `${compact(most)} ${unitText(field.unit)}`.trim();
};
const worded=(field)=>
field.unit==="m" ?{...field,write:lengthWords,read:parseLength,needed:LENGTH_NEEDED}:field;
function reaching(field,id,events){
const own=slider(worded(field),id,events);
const ends={...field.soft};
own.element.classList.add("amount");
return{
...own,
show(value,effective){
for(const each of [value,effective])
if(each>0)Object.assign(ends,{min:Math.min(ends.min,each),max:Math.max(ends.max,each)});
own.show(value,effective,{...ends});
},
};
}
const amount=reaching;
function amounts(field,id,events){
let most=0;
let shares=[1,1,1];
const give=()=>events.input(shares.map((share)=>exact(most * share)));
const whole=reaching({...field,soft:{...field.soft,min:field.log}},id,{
...events,
input(value){
if(value===undefined)return events.input(undefined);
most=value;
give();
},
});
const channels=CHANNELS.map((name,i)=>{
const own = slider({ ...SHARE, ...inPercent, title: `${field.title}, ${name.toLowerCase()}` }, `${id}-${name}`, {
...events,
input(value){
shares=shares.map((share,k)=>(k===i ?(value ?? 0):share));
give();
},
});
own.element
.querySelector("[type=range]")
.setAttribute("aria-label", `${field.title}, ${name.toLowerCase()}, share of the greatest`);
return{name,...own};
});
const rows=element(
"div",
{class:"shares"},
...channels.map(({name,element:own})=>
element("div",{class:"share","data-axis":name.toLowerCase()},element("span",{},name),own),
),
);
return{
element:element("div",{class:"amounts"},whole.element,rows),
drag:whole.drag,
show(value,effective){
const isSet=(value ?? null)!==null;
rows.hidden=!isSet;
const now=linear(value ?? 0);
most=Math.max(...now);
if (most > 0) shares = now.map((each) => each / most);
whole.show(isSet ? most:value,effective);
channels.forEach((each,i)=>each.show(exact(shares[i])));
},
};
}
return { amount, amountWords, amounts, isLength, worded };
})();
const lib_scrub = (() => {
const STILL=3;
const PACE=2;
function scrubBy(label,{begin,move,end,cancel}){
let hand=null;
const finish=(how)=>{
const was=hand;
hand=null;
document.removeEventListener("keydown",escape,true);
if(!was?.isScrubbing)return;
const swallow=(event)=>event.preventDefault();
label.addEventListener("click",swallow);
setTimeout(()=>label.removeEventListener("click",swallow));
how();
};
const escape=(event)=>{
if(event.key !=="Escape")return;
event.stopPropagation();
finish(cancel);
};
label.classList.add("scrubs");
label.addEventListener("pointerdown",({button,pointerId:id,clientX:x})=>{
if(button !==0||hand)return;
hand={id,x,steps:0,isScrubbing:false};
label.setPointerCapture(id);
});
label.addEventListener("pointermove",({pointerId,clientX,shiftKey})=>{
if(pointerId !==hand?.id)return;
if(!hand.isScrubbing){
if(Math.abs(clientX - hand.x)<STILL)return;
hand.isScrubbing=true;
document.addEventListener("keydown",escape,true);
begin();
}
const steps = Math.trunc((clientX - hand.x) / PACE);
if(!steps)return;
hand.x +=steps * PACE;
hand.steps +=steps *(shiftKey ? 10:1);
move(hand.steps);
});
for(const type of ["pointerup","pointercancel"])
label.addEventListener(type,({pointerId})=>{
if(pointerId===hand?.id)finish(end);
});
return label;
}
return { scrubBy };
})();
const forms_controls = (() => {
const { hex, linear, measureWords, parseColor } = lib_color;
const { element, isBeingEdited } = lib_dom;
const { parseTriple } = lib_number;
const { compact, inWords, narrow, unitText } = lib_format_text;
const { scrubBy } = lib_scrub;
const { amount, amounts } = forms_amounts;
const { numberEntry, placeholder, slider, track, withUnit } = forms_number_controls;
const STOPS=8;
const STOP={unit:"",open:{},soft:{},step:0.1};
const exact=(x)=>Number(x.toPrecision(5));
function choice(field,id,{input,commit}){
const select=element("select",{
id,
onchange:()=>{
input(select.value||undefined);
commit();
},
});
if(field.initial===undefined&&!field.required)select.append(element("option",{value:""},"Automatic"));
for(const name of field.choices.filter((option)=>option !==null)){
select.append(element("option",{value:name},inWords(name)));
}
return{
element:select,
show:(value)=>{
select.value=value ?? "";
},
};
}
function choices(field,id,{input,commit}){
let latest=[];
const selects=["U","V"].map((axis,i)=>{
const write=(word)=>{
latest=latest.map((old,k)=>(k===i ? word:old));
input(latest[0]===latest[1] ? word:latest);
};
const one = choice({ ...field, required: true }, i === 0 ? id : `${id}-${axis}`, { input: write, commit });
one.element.setAttribute("aria-label", `${field.title}, ${axis}`);
const letter=element("i",{"aria-hidden":"true"},axis);
return{...one,axis:element("span",{class:"axis","data-axis":axis},letter,one.element)};
});
return{
element:element("div",{class:"vector"},...selects.map(({axis})=>axis)),
show(value){
latest=Array.isArray(value)? value:[value,value];
selects.forEach((one,i)=>one.show(latest[i]));
},
};
}
function toggle(field,id,{input,commit}){
const box=element("input",{
type:"checkbox",
id,
class:"toggle",
onchange:()=>{
input(box.checked);
commit();
},
});
const show=(value)=>{
Object.assign(box,{checked:Boolean(value),indeterminate:(value ?? null)===null});
};
return{element:box,show};
}
function vector(field,id,{input,commit,refuse,restore}){
const names=field.length===2 ? ["U","V"]:field.isPerChannel ? ["red","green","blue"]:["X","Y","Z"];
let latest=null;
const entries=names.map((axis,i)=>{
const write=(x)=>narrow(x,Math.max(...(latest ?? [0]).map(Math.abs)));
const own={...field,required:true,write,words:(x)=>withUnit(field,x)};
const entry = numberEntry(own, i === 0 ? id : `${id}-${axis}`, {
input:(value)=>input(latest ? latest.map((x,k)=>(k===i ? value:x)):names.map(()=>value)),
commit,
refuse,
restore,
});
entry.element.setAttribute("aria-label", `${field.title}, ${axis}`);
return entry;
});
return{
element:element(
"div",
{class:"vector"},
...entries.map((entry,i)=>
element(
"span",
{class:"axis","data-axis":names[i]},
scrubBy(element("i",{"aria-hidden":"true"},names[i].charAt(0).toUpperCase()),entry.drag),
entry.element,
),
),
),
show(value){
const known=value ??(field.isPerChannel ? null:0);
latest=Array.isArray(known)||known===null ? known:names.map(()=>known);
entries.forEach((entry,i)=>entry.show(latest?.[i]));
},
};
}
function strengthControl(field,id,events){
const named=(title,more)=>({...field,title,ranges:true,initial:undefined,...more});
const title = `${field.title}, strength`;
const ends={min:2 ** -STOPS,max:2 ** STOPS};
const range = track(named(title, { soft: ends }), `${id}-strength`, events);
const stops = numberEntry({ ...STOP, title }, `${id}-stops`, {
...events,
input:(value)=>events.input(value===undefined ? undefined:exact(2 ** value)),
});
const entry = numberEntry(named(title, {}), `${id}-strength-entry`, events);
range.element.setAttribute("aria-label",title);
stops.element.setAttribute("aria-label", `${title} in stops`);
entry.element.setAttribute("aria-label", `${title}, number`);
return{
element:element(
"div",
{class:"slider strength"},
range.element,
element("span",{class:"stops"},stops.element,element("i",{"aria-hidden":"true"},"stops")),
entry.element,
),
show(value){
if(value>0){
ends.min=Math.min(ends.min,2 **(Math.floor(Math.log2(value))- 2));
ends.max=Math.max(ends.max,2 **(Math.ceil(Math.log2(value))+ 2));
}
range.show(value,undefined,{...ends});
stops.show(value>0 ? Number(Math.log2(value).toFixed(2)):null);
entry.show(value);
const told = value > 0 ? `${Number(Math.log2(value).toFixed(1))} stops, ` : "";
range.element.setAttribute("aria-valuetext", `${told}${compact(value)} ${unitText(field.unit)}`.trim());
},
};
}
function color(field,id,{input,commit,refuse,restore}){
const bright=!(field.max<=1);
let strength=1;
let tint=[1,1,1];
let isLinear=false;
const give=()=>input(tint.map((x)=>Number((x * strength).toPrecision(5))));
const swatch=element("input",{
type:"color",
id,
onchange:commit,
oninput:()=>{
tint=linear(swatch.value);
if(bright&&strength===0)strength=1;
give();
},
});
const text=element("input",{
type:"text",
class:"entry",
spellcheck:"false",
autocomplete:"off",
"aria-label": `${field.title}, #rrggbb or three linear numbers`,
placeholder:placeholder(field,"wide"),
title:field.absent,
oninput:()=>{
text.dataset.dirty="yes";
},
onblur:()=>{
delete text.dataset.dirty;
},
onkeydown:(event)=>{
if(event.key !=="Escape")return;
delete text.dataset.dirty;
restore();
},
onchange:()=>{
delete text.dataset.dirty;
if(text.value===""&&!isSet)return restore();
const known=parseColor(text.value);
const triple=parseTriple(text.value);
if(known)input(known.map((x)=>Number((x *(bright ? strength||1:1)).toPrecision(5))));
else if(triple)input(triple);
else return refuse("Write #rrggbb, rgb(), hsl(), 2700 K, or three linear numbers such as 0.2 0.4 0.6.");
commit();
},
});
const mode=element("button",{
type:"button",
class:"mode",
"aria-label": `${field.title}: linear numbers`,
"aria-pressed":"false",
onclick:()=>{
isLinear=!isLinear;
mode.setAttribute("aria-pressed",String(isLinear));
write();
},
});
let isSet=true;
let words=null;
const write=()=>{
const numbers=()=>(isLinear ? tint.map((x)=>compact(x * strength)).join(" "):hex(tint));
const shown=isSet ?(words ?? numbers()):"";
if(!isBeingEdited(text))text.value=shown;
mode.textContent=isLinear ? "lin":"hex";
};
const row=element("div",{class:"color"},swatch,text,mode);
const power=
bright&&
strengthControl(field,id,{
input:(value)=>{
strength=value ?? 0;
give();
},
commit,
refuse,
restore,
});
return{
element:power ? element("div",{},row,power.element):row,
show(value){
isSet=(value ?? null)!==null;
words=measureWords(value);
swatch.classList.toggle("unset",!isSet);
const now=linear(value ?? 0);
const most=Math.max(...now);
if(bright){
strength=most;
if (most > 0) tint = now.map((x) => x / most);
power.show(strength);
}else tint=now;
swatch.value=hex(tint);
write();
},
};
}
function fileEntry(id,{pick}){
const button=element("button",{type:"button",id,onclick:()=>pick()},"Choose a file…");
return{
element:button,
show(value){
button.textContent=value ? "Another file…":"Choose a file…";
},
};
}
function textEntry(id,{input,commit,restore}){
const clean=()=>{
delete box.dataset.dirty;
};
const box=element("input",{
type:"text",
class:"entry",
id,
autocomplete:"off",
spellcheck:"false",
oninput:()=>{
box.dataset.dirty="yes";
},
onchange:()=>{
clean();
input(box.value.trim()||undefined);
commit();
},
onkeydown:(event)=>{
if(event.key !=="Escape")return;
clean();
restore();
},
});
return{
element:box,
show(value){
if(!isBeingEdited(box))box.value=value ?? "";
},
};
}
const bounded=({soft})=>Number.isFinite(soft.max - soft.min);
function control(field,id,events){
if(field.make)return field.make(field,id,events);
if(field.widget==="amounts")return amounts(field,id,events);
if(field.widget==="amount")return amount(field,id,events);
if(field.widget==="color")return color(field,id,events);
if(field.widget==="strength")return strengthControl(field,id,events);
if(field.widget==="vector")return vector(field,id,events);
if(field.widget==="texture")return{element:element("span",{id}),show(){}};
if(field.widget==="file")return fileEntry(id,events);
if(field.widget==="choices")return choices(field,id,events);
if(field.widget==="text")return textEntry(id,events);
if(field.widget==="choice")return choice(field,id,events);
if(field.widget==="toggle")return toggle(field,id,events);
if(field.widget==="number"||!bounded(field))return numberEntry(field,id,events,"wide");
return slider(field,id,events);
}
return { control, strengthControl };
})();
const forms_folds = (() => {
const { hex, linear } = lib_color;
const { element } = lib_dom;
const { compact, inWords } = lib_format_text;
const { isObject } = lib_patch;
const { amountWords } = forms_amounts;
const ORDER=["Base","Specular","Coat","Sheen","Transmission","Subsurface","Film","Emission","Geometry"];
const MOST_WORDS=3;
const byHand=new Map();
const place=(group)=>(ORDER.indexOf(group)+ 1||ORDER.length + 1)- 1;
function words(field,value,group){
const{title,widget}=field;
const short = title.replace(new RegExp(`^(${group}|clearcoat) `, "i"), "").toLowerCase();
if (value?.texture !== undefined) return [`${short} ${value.texture}`];
if(widget==="color")return [swatch(value),short];
if(isObject(value))return [short];
if (["amount", "amounts"].includes(widget)) return [`${short} ${amountWords(field, value)}`];
if (typeof value === "boolean") return [value ? short : `no ${short}`];
return [`${short} ${typeof value === "string" ? inWords(value).toLowerCase() : compact(value)}`];
}
function swatch(value){
const now=linear(value);
const most=Math.max(1,...now);
const dot=element("i",{class:"swatch"});
dot.style.setProperty("background", hex(now.map((x) => x / most)));
return dot;
}
function folds(rows,fields){
const groups=[...new Set(fields.map(({group})=>group))].sort((a,b)=>place(a)- place(b));
let isMade=false;
let query="";
const parts=groups.map((group,i)=>{
const own=fields.filter((field)=>field.group===group);
const elements=own.map(({name})=>rows.get(name).element);
const told=element("span",{class:"told"});
const body=element("div",{class:"form"},...elements);
if(i===0)
return{
group,
own,
told,
node:element(
"section",
{class:"fold",role:"group","aria-label":group},
element("h3",{},group),
body,
),
};
const head=element("summary",{},element("h3",{},group),told);
const node=element("details",{class:"fold","aria-label":group},head,body);
head.addEventListener("click",()=>{
if(!query)byHand.set(group,!node.open);
});
return{group,own,told,node};
});
const sift=()=>{
for(const{group,own,node}of parts){
const isFound = ({ title, hint, name }) => `${group} ${title} ${name} ${hint}`.toLowerCase().includes(query);
const found=own.filter(isFound);
for(const{name}of own)
rows.get(name).element.classList.toggle("sifted",Boolean(query)&&!found.some((f)=>f.name===name));
node.classList.toggle("sifted",Boolean(query)&&!found.length);
if(node.tagName !=="DETAILS")continue;
if(query)node.open=found.length>0;
else node.open=byHand.get(group)?? node.classList.contains("changed");
}
};
return{
element:element("div",{class:"folds"},...parts.map(({node})=>node)),
show(values){
for(const{group,own,told,node}of parts){
const changed=own.filter(({name})=>rows.get(name).isChanged());
const first=changed.slice(0,MOST_WORDS);
const now=JSON.stringify([changed.length,first.map(({name})=>[name,values[name]])]);
if(told.dataset.now !==now){
const parts=first.flatMap((field,i)=>[
...(i ? [", "]:[]),
...words(field,values[field.name],group),
]);
told.replaceChildren(...parts,...(changed.length>MOST_WORDS ? [", …"]:[]));
told.dataset.now=now;
}
node.classList.toggle("changed",changed.length>0);
}
if(!isMade)sift();
isMade=true;
},
reveal(name){
const node=rows.get(name)?.element.closest("details.fold");
if(node)node.open=true;
},
filter(text){
query=text.trim().toLowerCase();
sift();
},
};
}
return { folds };
})();
const lib_files = (() => {
function acceptFiles(node,take){
node.addEventListener("dragover",(event)=>{
if(!event.dataTransfer.types.includes("Files"))return;
event.preventDefault();
event.stopPropagation();
node.classList.add("over");
});
node.addEventListener("dragleave",()=>node.classList.remove("over"));
node.addEventListener("drop",(event)=>{
node.classList.remove("over");
const [file]=event.dataTransfer.files;
if(!file)return;
event.preventDefault();
take(file);
});
}
return { acceptFiles };
})();
const lib_tooltip = (() => {
const { element } = lib_dom;
const PATIENCE_MS=350;
const WRITTEN=["text","button"];
const bubble=element("div",{class:"tooltip","aria-hidden":"true",hidden:true});
let timer=0;
function open(row,text){
bubble.textContent=text;
document.body.append(bubble);
bubble.hidden=false;
const box=row.getBoundingClientRect();
const below=box.bottom + bubble.offsetHeight + 8<window.innerHeight;
bubble.style.setProperty(
"left",
`${Math.max(8, Math.min(box.left, window.innerWidth - bubble.offsetWidth - 8))}px`,
);
bubble.style.setProperty("top", `${below ? box.bottom + 4 : box.top - bubble.offsetHeight - 4}px`);
}
function closeTooltip(){
clearTimeout(timer);
bubble.hidden=true;
}
function describe(row,handle,text){
handle.addEventListener("pointerenter",()=>{
clearTimeout(timer);
timer=setTimeout(open,PATIENCE_MS,row,text);
});
handle.addEventListener("pointerleave",closeTooltip);
row.addEventListener("focusin",({target})=>{
if(!WRITTEN.includes(target.type)&&target.matches(":focus-visible"))open(row,text);
});
row.addEventListener("focusout",closeTooltip);
row.addEventListener("pointerdown",closeTooltip);
row.addEventListener("keydown",(event)=>{
if(event.key==="Escape")closeTooltip();
});
}
return { describe };
})();
const forms_schema_form = (() => {
const { linear } = lib_color;
const { isLength } = forms_amounts;
const { control } = forms_controls;
const { element, freshId } = lib_dom;
const { folds } = forms_folds;
const { acceptFiles } = lib_files;
const { equal, isObject } = lib_patch;
const { followed } = server_schema;
const { scrubBy } = lib_scrub;
const { endsOf } = lib_span;
const { describe } = lib_tooltip;
const { unitText } = lib_format_text;
const isSame=({widget},a,b)=>
["color","amounts"].includes(widget)&&a !==undefined&&b !==undefined
? equal(linear(a),linear(b))
:equal(a,b);
const isTexture=(value)=>isObject(value)&&value.texture !==undefined;
function row(field,{change,commit,forgive,takeFile,pickFile,slot,beneath}){
const id=freshId(field.name);
const trouble = element("p", { class: "trouble", id: `${id}-trouble`, hidden: true });
const mark=(text)=>{
trouble.hidden=!text;
trouble.textContent=text ?? "";
for(const input of node.querySelectorAll("input, select")){
if(under?.element.contains(input))continue;
if(text)input.setAttribute("aria-invalid","true");
else input.removeAttribute("aria-invalid");
}
};
let latest;
let isChanged=false;
const widget=control(field,id,{
input:(value)=>{
mark(null);
change(field.name,value);
},
commit,
pick:()=>pickFile?.(field),
refuse:mark,
restore:()=>{
mark(null);
widget.show(latest);
forgive();
},
});
const reset=element("button",{
type:"button",
class:"reset",
"aria-label": `Reset ${field.title}`,
onclick:()=>{
mark(null);
change(field.name,undefined);
commit();
},
});
const label=element("label",{for:id},field.title);
if(field.unit&&!isLength(field)){
const unit=unitText(field.unit);
label.append(unit.length<3 ? "\u00a0":" ",element("span",{class:"unit","aria-hidden":"true"},unit));
}
if(widget.drag)scrubBy(label,widget.drag);
const hint = field.hint ? element("p", { class: "unseen", id: `${id}-hint` }, field.hint) : null;
const image=field.takesTexture
? slot?.(field,()=>{
change(field.name,undefined);
commit();
})
:undefined;
const under=image&&beneath?.(field);
const parts=[label,widget.element,image?.chip,image?.button,reset,under?.element,hint,trouble].filter(
Boolean,
);
const node=element("div",{class:image ? "field pictured":"field","data-field":field.name},...parts);
if(image&&takeFile)acceptFiles(node,(file)=>takeFile(field.name,file));
for(const input of node.querySelectorAll("input, select")){
input.setAttribute("aria-describedby", `${hint ? hint.id : ""} ${trouble.id}`.trim());
}
if(hint)describe(node,label,field.hint);
return{
element:node,
mark,
isChanged:()=>isChanged,
show(value,initial=field.initial,effective=undefined,ends=undefined){
latest=value ?? initial;
const textured=isTexture(latest);
if(image){
widget.element.hidden=textured||field.widget==="texture";
image.show(latest);
under?.show(latest);
}
if(trouble.hidden&&!textured)widget.show(latest,effective,ends);
isChanged=value !==undefined&&!isSame(field,value,initial);
reset.hidden=textured||field.required||!isChanged;
},
};
}
function schemaForm(fields,acts){
const rows=new Map(fields.map((field)=>[field.name,row(field,acts)]));
const parts=fields.some(({group})=>group)? folds(rows,fields):null;
return{
element:parts?.element ?? element("div",{class:"form"},...[...rows.values()].map((each)=>each.element)),
filter:(text)=>parts?.filter(text),
show(values,initials={}){
for(const [name,each] of rows){
const field=fields.find((one)=>one.name===name);
const valueOf=(leader)=>values[leader] ?? fields.find((one)=>one.name===leader)?.initial;
const ends=field.ranges&&endsOf(field,valueOf(field.ranges.field));
each.show(values[name],initials[name],followed(field,valueOf(field.follows?.field)),ends);
each.element.classList.toggle(
"unused",
Boolean(field.used)&&!field.used.values.includes(valueOf(field.used.field)),
);
each.element.hidden=(values[field.unless] ?? null)!==null;
}
parts?.show(values);
},
mark(name,text){
rows.get(name)?.mark(text);
if(text)parts?.reveal(name);
return rows.has(name);
},
forgive(){
for(const each of rows.values())each.mark(null);
},
};
}
return { schemaForm };
})();
const widget_panel = (() => {
const { element, freshId } = lib_dom;
const { isObject, pointer, put } = lib_patch;
const { schemaForm } = forms_schema_form;
const { fields, materialModels } = server_schema;
const option=(value,title=value)=>element("option",{value},title);
function slot(){
const chip=element("span",{class:"chip"});
return{
chip,
show(value){
chip.hidden=!(isObject(value)&&value.texture !==undefined);
if(!chip.hidden)chip.textContent=value.texture;
},
};
}
const isSlid=({widget})=>!["texture","file"].includes(widget);
function menu(title,entries,act){
const select=element(
"select",
{
"aria-label":title,
onchange:()=>{
const{value}=select;
select.value="";
if(value)act(value);
},
},
option("", `${title}…`),
...entries.map(({name,title:words})=>option(name,words)),
);
return select;
}
function panel({schema,presets,current,change,take,choose,home}){
const models=materialModels(schema);
const id=freshId("material");
const materials=element("select",{id,onchange:()=>choose(materials.value)});
const place=element("div",{class:"parameters"});
let name="";
let form=null;
const give=(field,value)=>change(put(current(),pointer("materials",name,field),value));
const made=(type)=>{
const made=schemaForm(fields(schema,models[type]).filter(isSlid),{
change:give,
commit(){},
forgive(){},
slot,
});
place.replaceChildren(made.element);
return{type,...made};
};
const inside=element(
"div",
{class:"inside"},
element(
"div",
{class:"menus"},
menu("Scene",presets.scenes,(value)=>take("scenes",value)),
menu("Environment",presets.environments,(value)=>take("environments",value)),
element("button",{type:"button",onclick:home},"Reset view"),
),
element(
"div",
{class:"menus material"},
element("label",{for:id},"Material"),
materials,
menu("Library",presets.materials,(value)=>take("materials",value)),
),
place,
);
return{
element:element("div",{class:"panel"},inside),
show(scene,chosen){
const names=Object.keys(scene.materials);
if(names.join("\n")!==[...materials.options].map(({value})=>value).join("\n"))
materials.replaceChildren(...names.map((each)=>option(each)));
materials.value=chosen;
name=chosen;
const material=scene.materials[chosen];
if(!material||!models[material.type]){
place.replaceChildren();
form=null;
return;
}
if(form?.type !==material.type)form=made(material.type);
form.show(material);
},
mark:(place,text)=>{
const [, , material, field] = place.split("/");
return material===name&&Boolean(form?.mark(field,text));
},
};
}
return { panel };
})();
const lib_vector = (() => {
const add=(a,b)=>a.map((x,i)=>x + b[i]);
const subtract=(a,b)=>a.map((x,i)=>x - b[i]);
const scale=(a,s)=>a.map((x)=>x * s);
const dot=(a,b)=>a.reduce((sum,x,i)=>sum + x * b[i],0);
const cross=([a,b,c],[x,y,z])=>[b * z - c * y,c * x - a * z,a * y - b * x];
const length=(a)=>Math.hypot(...a);
const normalize = (a) => scale(a, 1 / length(a));
const DUST=1e-9;
const tidy=(a)=>{
const least=DUST * Math.max(...a.map(Math.abs));
return a.map((x)=>(Math.abs(x)<least ? 0:Number(x.toPrecision(7))));
};
function turn(v,axis,angle){
const [c,s]=[Math.cos(angle),Math.sin(angle)];
return add(add(scale(v,c),scale(cross(axis,v),s)),scale(axis,dot(axis,v)*(1 - c)));
}
return { add, cross, dot, length, normalize, scale, subtract, tidy, turn };
})();
const document_camera = (() => {
const { add, cross, dot, length, normalize, scale, subtract, tidy, turn } = lib_vector;
const POLE = (2 * Math.PI) / 180;
const radians = (degrees) => (degrees * Math.PI) / 180;
function swing(arm,up,right,down){
const pole=normalize(up);
const turned=turn(arm,pole,-right);
const side=normalize(cross(pole,turned));
const now=Math.acos(Math.min(Math.max(dot(pole,normalize(turned)),-1),1));
const wanted=Math.min(Math.max(now - down,POLE),Math.PI - POLE);
return turn(turned,side,wanted - now);
}
const orbit=({position,target,up},right,down)=>({
position:tidy(add(target,swing(subtract(position,target),up,right,down))),
});
function axes({position,target,up}){
const view=subtract(target,position);
const forward=normalize(view);
const right=normalize(cross(forward,up));
return{right,up:cross(right,forward),forward,distance:length(view)};
}
const flat={
project(camera,way,{right,up,forward},aspect){
const z=dot(way,forward);
const tall=halfHeight(camera,z);
return { x: (dot(way, right) / (tall * aspect) + 1) / 2, y: (1 - dot(way, up) / tall) / 2, z };
},
};
const across=(tall,x,y,{right,up},aspect)=>
add(scale(right,(2 * x - 1)* tall * aspect),scale(up,(1 - 2 * y)* tall));
const KINDS={
perspective:{
...flat,
halfHeight: ({ vfov }, distance) => distance * Math.tan(radians(vfov) / 2),
direction:(camera,x,y,frame,aspect)=>
add(frame.forward,across(halfHeight(camera,1),x,y,frame,aspect)),
},
orthographic:{
...flat,
halfHeight: ({ height }) => height / 2,
shown:(height)=>({height}),
narrowed:({height},factor)=>({height:Number((height * factor).toPrecision(6))}),
fitted:(height)=>({height:Number(height.toPrecision(4))}),
offset:(camera,x,y,frame,aspect)=>across(halfHeight(camera,1),x,y,frame,aspect),
direction:(_camera,_x,_y,{forward})=>forward,
},
panorama:{
isAround:true,
halfHeight: (_, distance) => (distance * Math.PI) / 2,
project(_,way,{right,up,forward}){
const [x,y,z]=[right,up,forward].map((axis)=>dot(way,axis));
return{
x: 0.5 + Math.atan2(x, z) / (2 * Math.PI),
y: Math.atan2(Math.hypot(x, z), y) / Math.PI,
z:length(way),
};
},
direction(_,x,y,{right,up,forward}){
const [azimuth,polar]=[2 * Math.PI *(x - 0.5),Math.PI * y];
const level=add(scale(right,Math.sin(azimuth)),scale(forward,Math.cos(azimuth)));
return add(scale(level,Math.sin(polar)),scale(up,Math.cos(polar)));
},
},
};
const kindOf=({type})=>KINDS[type] ?? KINDS.perspective;
const isAround=(camera)=>Boolean(kindOf(camera).isAround);
const halfHeight=(camera,distance)=>kindOf(camera).halfHeight(camera,distance);
function turned(camera,type){
const{position,target,up}=camera;
const height=Number((2 * halfHeight(camera,axes(camera).distance)).toPrecision(3));
return{type,position,target,up,...KINDS[type].shown?.(height)};
}
function pan(camera,right,down){
const{position,target}=camera;
const frame=axes(camera);
const height=2 * halfHeight(camera,frame.distance);
const shift=add(scale(frame.right,-right * height),scale(frame.up,down * height));
return{position:tidy(add(position,shift)),target:tidy(add(target,shift))};
}
const zoom=(camera,factor)=>
kindOf(camera).narrowed?.(camera,factor)??{
position:tidy(add(camera.target,scale(subtract(camera.position,camera.target),factor))),
};
function frame(camera,{center,radius},aspect,share=0.8){
const{position,target}=camera;
const narrow=Math.min(1,aspect);
const{fitted}=kindOf(camera);
const half=Math.atan(halfHeight(camera,1)* narrow);
const distance=fitted
? Math.max(axes(camera).distance,2 * radius)
: radius / Math.sin(Math.max(half * share, 1e-3));
const back=normalize(subtract(position,target));
const height = (2 * radius) / (share * narrow);
return{position:tidy(add(center,scale(back,distance))),target:tidy(center),...fitted?.(height)};
}
const project=(camera,point,aspect)=>
kindOf(camera).project(camera,subtract(point,camera.position),axes(camera),aspect);
return { axes, frame, halfHeight, isAround, orbit, pan, project, turned, zoom };
})();
const picture_gestures = (() => {
const ORBIT_PER_WIDTH=Math.PI;
const LOOK_PER_WIDTH = Math.PI / 3;
const WHEEL_ZOOM=0.0015;
const WHEEL_UNITS=[1,16,400];
const STILL=4;
const WHEEL_REST_MS=400;
const middle=(points)=>({
x: points.reduce((sum, p) => sum + p.x, 0) / points.length,
y: points.reduce((sum, p) => sum + p.y, 0) / points.length,
spread:points.length>1 ? Math.hypot(points[0].x - points[1].x,points[0].y - points[1].y):0,
});
function watchGestures(stage,move,tool){
const fingers=new Map();
let last=null;
let began=null;
let kind="orbit";
let turning=0;
stage.addEventListener("contextmenu",(event)=>event.preventDefault());
const meaning=(event)=>{
if(tool()==="inspect")return "slide";
if(event.button !==0||event.shiftKey)return "pan";
if(event.altKey)return "turn";
return tool()==="fly" ? "look":"orbit";
};
const drag=(right,down)=>{
const [w,h]=[stage.clientWidth,stage.clientHeight];
if(kind==="slide")move.slide(right,down);
else if (fingers.size > 1 || kind === "pan") move.pan(right / h, down / h);
else if (kind === "turn") move.turn(right / w);
else if (kind === "look") move.look((right / w) * LOOK_PER_WIDTH, (down / w) * LOOK_PER_WIDTH);
else move.orbit((right / w) * ORBIT_PER_WIDTH, (down / w) * ORBIT_PER_WIDTH);
};
stage.addEventListener("pointerdown",(event)=>{
stage.setPointerCapture(event.pointerId);
if(event.button===1)event.preventDefault();
fingers.set(event.pointerId,{x:event.clientX,y:event.clientY});
last=middle([...fingers.values()]);
if(fingers.size===1){
kind=meaning(event);
began=event.button===0 ? last:null;
}else began=null;
});
stage.addEventListener("pointermove",(event)=>{
move.hover(event.clientX,event.clientY);
if(!fingers.has(event.pointerId))return;
fingers.set(event.pointerId,{x:event.clientX,y:event.clientY});
const now=middle([...fingers.values()]);
if(began&&Math.hypot(now.x - began.x,now.y - began.y)<STILL)return;
began=null;
stage.classList.add("held");
drag(now.x - last.x,now.y - last.y);
if (last.spread > 0 && now.spread > 0) move.zoom(last.spread / now.spread, now.x, now.y);
last=now;
});
const lift=(event)=>{
if(!fingers.delete(event.pointerId))return;
last=fingers.size ? middle([...fingers.values()]):null;
if(fingers.size)return;
stage.classList.remove("held");
if(began&&event.type==="pointerup")move.tap(event.clientX,event.clientY,event.altKey);
else move.endGesture();
began=null;
};
stage.addEventListener("pointerup",lift);
stage.addEventListener("pointercancel",lift);
stage.addEventListener(
"wheel",
(event)=>{
event.preventDefault();
clearTimeout(turning);
turning=setTimeout(move.endGesture,WHEEL_REST_MS);
const scrolled=event.deltaY * WHEEL_UNITS[event.deltaMode] * WHEEL_ZOOM *(event.ctrlKey ? 4:1);
move.zoom(Math.exp(scrolled),event.clientX,event.clientY);
},
{passive:false},
);
}
return { watchGestures };
})();
const widget_picture = (() => {
const { orbit, pan, zoom } = document_camera;
const { element } = lib_dom;
const { watchGestures } = picture_gestures;
const KEY_ORBIT = Math.PI / 24;
const KEY_ZOOM=1.1;
const STEPS={ArrowLeft:[-1,0],ArrowRight:[1,0],ArrowUp:[0,-1],ArrowDown:[0,1]};
const ZOOMS = { "+": 1 / KEY_ZOOM, "=": 1 / KEY_ZOOM, "-": KEY_ZOOM };
function picture({camera,move}){
const canvas=element("canvas",{
tabindex:"0",
role:"img",
"aria-label":"Picture. Drag to orbit, with Shift to pan; arrow keys orbit, plus and minus zoom.",
});
const stage=element("div",{class:"stage"},canvas);
const by=(change,...amounts)=>move(change(camera(),...amounts));
watchGestures(
canvas,
{
orbit:(right,down)=>by(orbit,right,down),
pan:(right,down)=>by(pan,right,down),
zoom:(factor)=>by(zoom,factor),
turn(){},
look(){},
slide(){},
hover(){},
tap(){},
endGesture(){},
},
()=>"orbit",
);
canvas.addEventListener("pointerdown",()=>canvas.focus({preventScroll:true}));
stage.addEventListener(
"wheel",
(event)=>{
if(document.activeElement !==canvas&&!event.ctrlKey)event.stopPropagation();
},
{capture:true},
);
canvas.addEventListener("keydown",(event)=>{
if(event.ctrlKey||event.metaKey||event.altKey)return;
const step=STEPS[event.key];
if (step && event.shiftKey) by(pan, step[0] / 20, step[1] / 20);
else if(step)by(orbit,step[0] * KEY_ORBIT,step[1] * KEY_ORBIT);
else if(ZOOMS[event.key])by(zoom,ZOOMS[event.key]);
else return;
event.preventDefault();
event.stopPropagation();
});
let shown={generation:-1,seq:-1};
return{
element:stage,
async paint(frame,bytes){
const image=await createImageBitmap(new Blob([bytes],{type:frame.mime}));
const isOlder=frame.generation<shown.generation;
if(!isOlder){
shown=frame;
Object.assign(canvas,{width:image.width,height:image.height});
canvas.getContext("2d").drawImage(image,0,0);
canvas.style.setProperty("aspect-ratio", `${image.width} / ${image.height}`);
}
image.close();
},
};
}
return { picture };
})();
const widget_widget = (() => {
const { beginIds, element } = lib_dom;
const { amount, percent } = lib_format_text;
const { diff } = lib_patch;
const { cameraModels, defaults } = server_schema;
const { panel } = widget_panel;
const { picture } = widget_picture;
const PATIENCE_MS=2000;
const BUSY="The kernel is busy. The picture follows when it is free.";
function view({model,el}){
beginIds(crypto.getRandomValues(new Uint16Array(1))[0] * 1000);
const me=crypto.randomUUID();
const status=element("output",{class:"status",role:"status"});
const samples=element("span",{class:"samples"});
let scene=null;
let sent=null;
let home=null;
let schema=null;
let side=null;
let waits=0;
let number=0;
const send=(type,more)=>model.send({type,view:me,...more});
const say=(text)=>{
status.textContent=text;
};
const flush=()=>{
if(waits||!scene)return;
const patch=diff(sent,scene);
if(patch===undefined)return;
sent=scene;
number +=1;
waits=setTimeout(say,PATIENCE_MS,BUSY);
send("edit",{number,patch});
};
const change=(next)=>{
scene=next;
show();
flush();
};
const camera=()=>{
const models=cameraModels(schema);
const [usual]=Object.keys(models);
return{...defaults(schema,models[scene.camera?.type ?? usual]),...scene.camera};
};
const move=(changes)=>{
if(scene)change({...scene,camera:{...scene.camera,...changes}});
};
const canvas=picture({camera,move});
const show=()=>side?.show(scene,model.get("material"));
const heard={
begin({schema:described,presets,scene:first}){
schema=described;
side=panel({
schema,
presets,
current:()=>scene,
change,
take:(kind,name)=>send("preset",{kind,name}),
choose(name){
model.set("material",name);
model.save_changes();
},
home:()=>move({...home}),
});
root.append(side.element);
heard.scene({scene:first,is_home:true});
},
scene({scene:next,is_home:isHome,but}){
if(!side||but===me)return;
scene=next;
sent=next;
if(isHome)home=next.camera;
say("");
show();
},
taken({number:taken}){
if(taken !==number)return;
clearTimeout(waits);
waits=0;
if(status.textContent===BUSY)say("");
flush();
},
refused({pointer,detail,scene:last}){
heard.scene({scene:last});
if (!side?.mark(pointer, detail)) say(pointer ? `${pointer}: ${detail}` : detail);
},
async frame(frame,[bytes]){
try{
await canvas.paint(frame,bytes);
}finally{
send("ack",{seq:frame.seq});
}
const noise = frame.noise === null ? "" : `, ${percent(frame.noise)} noise`;
samples.textContent = `${amount(frame.samples, "sample")}${noise}`;
},
};
const hear=(message,buffers)=>{
if(!message.view||message.view===me)heard[message.type]?.(message,buffers);
};
const root=element(
"div",
{
class:"sunbox-view",
onfocusin:({target})=>target.setAttribute("data-lm-suppress-shortcuts","true"),
onkeydown:({key,target})=>{
if(key==="Enter"&&target.type==="text")target.dispatchEvent(new Event("change"));
},
},
element("div",{class:"shown"},canvas.element,element("div",{class:"line"},samples,status)),
);
el.append(root);
model.on("msg:custom",hear);
model.on("change:material",show);
let isSeen=true;
const look=(isIn)=>{
const seen=isIn&&document.visibilityState==="visible";
if(seen===isSeen)return;
isSeen=seen;
send(seen ? "seen":"unseen");
};
let isIn=true;
const observer=new IntersectionObserver((entries)=>{
isIn=entries.at(-1).isIntersecting;
look(isIn);
});
const turned=()=>look(isIn);
observer.observe(canvas.element);
document.addEventListener("visibilitychange",turned);
send("hello");
return()=>{
observer.disconnect();
document.removeEventListener("visibilitychange",turned);
model.off("msg:custom",hear);
model.off("change:material",show);
clearTimeout(waits);
send("unseen");
};
}
const $default={render:view};
return { default: $default };
})();
export default widget_widget.default;

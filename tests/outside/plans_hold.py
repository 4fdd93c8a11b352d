#!/usr/bin/python3
"""Random plans applied on simulated lenses (fixed, zoom, breathing, backlash of focus and iris, drift, moving centre, several
at once), judged from the scene's description of the lens: reached.feasible is true of the blur, and Status agrees."""
import os, re, sys
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from outside import *

bins = Bins(sys.argv)
report = Report("plans hold")
NUMBER = int(os.environ.get("OUTSIDE_CASES", "48"))
rnd = random
U = random.uniform
L = lambda a, b: math.exp(random.uniform(math.log(a), math.log(b)))
KINDS=["fixed","zoom","breathing","focusbl","irisbl","drift","centre","several"]

class Lens: pass

def Draw(i, kind):
    l=Lens(); l.name="l%d"%i; l.kind=kind
    has=lambda k: kind==k or (kind=="several" and rnd.random()<0.6)
    l.zoom = has("zoom") or kind=="centre"
    l.f0=round(L(4,150),2)
    l.f1=round(l.f0*U(1.3,3),2) if l.zoom else l.f0
    l.cs=round(U(0,0.5)*l.f0,2) if (kind=="centre" or (l.zoom and has("centre"))) else 0.0
    l.N0=round(L(1,5),2); l.N1=round(l.N0*L(3,20),1)
    zmin=l.f1*U(4,40)
    l.e0=0.0 if rnd.random()<0.7 else round(-0.02*l.f0*U(0,1),4)
    l.e1=round(l.f1*l.f1/(zmin-l.f1),4)
    l.steps=int(L(150,20000)); l.isteps=int(L(8,400))
    l.br=round(U(-0.08,0.08),4) if has("breathing") else 0.0
    l.fbl=int(l.steps*U(0.002,0.06))+1 if has("focusbl") else 0
    l.ibl=int(l.isteps*U(0.01,0.12))+1 if has("irisbl") else 0
    l.T=round(U(-10,50),1) if has("drift") else 20.0
    l.drift=round(U(0.2,3),2) if l.T!=20.0 else 0.0
    l.told=True
    l.pix=round(L(1.5,20),2)
    l.lost0 = rnd.random()<0.5
    l.bl_told = rnd.random()<0.5
    l.compensate = rnd.random()<0.5
    l.approach = "far" if l.fbl and rnd.random()<0.3 else "near"
    return l

def Files(l):
    w,h=160,128
    walls=""
    for j,(u,p) in enumerate(l.walls):
        d="inf" if u==0 else repr(1/u/1000)
        walls+='[[surface]]\nkind="wall"\ndistance_m=%s\nsinusoid_px=[0.0,%r]\nregion=[%r,0.0,0.5,1.0]\n'%(d,p,0.5*j)
    scene='version=1\n[camera]\nwidth=%d\nheight=%d\npixel_um=%r\nbits=16\nframe_rate_hz=200\nexposure_ms=1\n[lens]\nmodel="thin"\n'%(w,h,l.pix)
    scene+='focal_length_mm=%s\n'%( "[%r,%r]"%(l.f0,l.f1) if l.zoom else repr(l.f0))
    scene+='f_number=[%r,%r]\nextension_mm=[%r,%r]\nsteps=%d\nspeed_steps_per_s=%r\nacceleration_steps_per_s2=%r\nsettle_ms=2\niris_steps=%d\ninitial_f_number=%r\n'%(l.N0,l.N1,l.e0,l.e1,l.steps,float(l.steps*20),float(l.steps*2000),l.isteps,l.N0)
    if l.cs: scene+='centre_shift_mm=%r\n'%l.cs
    if l.br: scene+='breathing=%r\n'%l.br
    if l.fbl: scene+='backlash_steps=%d\n'%l.fbl
    if l.ibl: scene+='iris_backlash_steps=%d\n'%l.ibl
    if l.T!=20: scene+='temperature_c=%r\ndrift_um_per_c=%r\n'%(l.T,l.drift)
    conf='[[lens]]\nname="%s"\ndriver="sim"\nscene="%s.toml"\n'%(l.name,l.name)
    files={l.name+".toml":scene+walls}
    cal=''
    if l.br:
        span=l.e1-l.e0
        # the scene: focal length at extension 0 is the stated one, changes by `breathing` over the focus range
        pts=["{ extension_mm=%r, ratio=%r }"%(e,1+l.br*e/span) for e in ([l.e0,0.0,l.e1] if l.e0<0 else [0.0,l.e1])]
        cal+='[breathing]\npoints=[%s]\n'%", ".join(pts)
    if cal:
        l.cal='version=1\nserial=""\nmade="outside"\ngrade="calibrated"\n'+cal
    conf+='[lens.focus]\napproach="%s"\n'%l.approach
    if l.lost0: conf+='lost_travel=0.0\n'
    if l.fbl and l.bl_told: conf+='backlash=%d\n'%l.fbl
    if l.zoom and l.lost0: conf+='[lens.zoom]\nlost_travel=0.0\n'
    conf+='[lens.iris]\n'
    if l.lost0: conf+='lost_travel=0.0\n'
    if l.ibl and l.bl_told: conf+='backlash=%d\n'%l.ibl
    if l.T!=20: conf+='[lens.temperature]\ncompensate=%s\num_per_c=%r\nreference_c=20.0\n'%("true" if l.compensate else "false",l.drift)
    files["conf/"+l.name]=conf
    return files

def E(l,pos): return l.e0+(l.e1-l.e0)*pos/(l.steps-1)
def NN(l,k): return l.N0*(l.N1/l.N0)**(k/(l.isteps-1))
def F(l,zoom,e): return (zoom if l.zoom else l.f0)*(1+l.br*e/(l.e1-l.e0))
def Shift(l,zoom): return l.cs*(zoom-l.f0)/(l.f1-l.f0) if l.zoom else 0.0

def Worst(l,lim,zoom,pos,k):
    """blur over limit for a sharp limit, limit over blur for a blurred one, of the mechanism at these positions"""
    s=[]
    for u in (lim["u0"],lim["u1"]):
        e=E(l,pos)+l.drift*(l.T-20)/1000
        v=0.0 if u==0 else 1/(1/u-Shift(l,zoom))
        s.append(1000*SignedBlur(F(l,zoom,E(l,pos)),(zoom if l.zoom else l.f0)/NN(l,k),F(l,zoom,E(l,pos))+e,v))
    if lim["kind"]=="sharp": return max(abs(s[0]),abs(s[1]))/lim["limitUm"]
    behind,front=max(min(s),1e-12),max(-max(s),1e-12)
    side=lim.get("side","either")
    return lim["limitUm"]/(behind if side=="behind" else front if side=="front" else max(behind,front))

def DrawLimits(l):
    # a setting that exists, and limits round it
    zoom=U(l.f0,l.f1)
    p=U(0.1,0.9)*(l.steps-1); k=U(0,1)**2*(l.isteps-1)*0.8
    l.zoomgoal=round(zoom,3) if l.zoom else l.f0
    zoom=l.zoomgoal
    e=E(l,p); f=F(l,zoom,e); us=e/(f*(f+e))   # vergence 1/mm in focus, from the centre where it is
    shift=Shift(l,zoom)
    toscene=lambda v: 0.0 if v<=0 else 1/(1/v+shift)
    A=(zoom if l.zoom else l.f0)/NN(l,k)
    lims=[]
    ns=rnd.choice([1,1,1,2]); nb=rnd.choice([0,0,1,1,2])
    for i in range(ns):
        b=l.pix*L(0.5,6)/1000  # mm of blur
        dv=b/(A*(f+e))
        v0=us+dv*U(-1,1); v1=us+dv*U(-1,1)
        if rnd.random()<0.2: v1=v0
        slack=L(0.7,2.0)
        worst=max(abs(v0-us),abs(v1-us))*A*(f+e)*1000
        if worst<1e-3: worst=b*1000
        lims.append(dict(kind="sharp",u0=toscene(v0),u1=toscene(v1),limitUm=round(worst*slack,3)))
    for i in range(nb):
        behind=rnd.random()<0.5
        b=l.pix*L(1,30)/1000; dv=b/(A*(f+e))
        v0=us-dv if behind else us+dv
        v1=v0-dv*U(0,3) if behind else v0+dv*U(0,3)
        if behind and v0<=0: v0=0.0
        if behind and v1<=0: v1=0.0
        if v0<=0 and not behind: continue
        v0s,v1s=toscene(v0),toscene(v1)
        if max(v0s,v1s)>1/(1.5*f+shift): continue
        least=abs(A*((f+e)*(1/f-max(v0,0))-1))*1000
        if least<0.05: continue
        lims.append(dict(kind="blurred",u0=v0s,u1=v1s,limitUm=round(least/L(0.7,2.0),3),side=rnd.choice(["either","behind" if behind else "front"])))
    lims=[x for x in lims if x["limitUm"]>0.01]
    for x in lims:
        # what is sent is a distance with few digits: keep it as the truth
        for key in ("u0","u1"):
            if x[key]>0:
                d=float("%.7g"%(1/x[key]/1000)); x[key]=1/(d*1000); x[key+"d"]=d
            else: x[key+"d"]=None
    l.lims=lims
    s=lims[0]
    c=s["limitUm"]/l.pix
    per=min(40.0,max(3.0,round(2.3*c,2)))
    l.walls=[(s["u0"],per),(s["u1"],per)]

def Request(l):
    out=[]
    for i,x in enumerate(l.lims):
        D=lambda key: {"distanceM":x[key+"d"]} if x[key+"d"] is not None else {"vergenceD":0.0}
        y=dict(name="n%d"%i,kind=x["kind"],limitUm=x["limitUm"],depths=[{"oneEnd":D("u0"),"otherEnd":D("u1")}])
        if "side" in x: y["side"]=x["side"]
        out.append(y)
    return {"limits":out}


def Untaken(moves, axis):
    for m in moves:
        if m["axis"]==axis:
            found=re.search(r"([0-9.]+) steps of backlash not taken up", m["reason"] or "")
            return float(found.group(1)) if found else 0.0
    return 0.0

batch=24
for begin in range(0,NUMBER,batch):
    lenses,files=[],{}
    for i in range(min(batch,NUMBER-begin)):
        l=Draw(i,KINDS[(begin+i)%len(KINDS)])
        l.steps=min(l.steps,4000)
        for _ in range(20):
            DrawLimits(l)
            if l.lims and l.lims[0]["kind"]=="sharp": break
        l.walls=l.walls[:1]
        files.update(Files(l)); lenses.append(l)
    files["lensd.toml"]="version=1\n"+"".join(files.pop("conf/"+l.name) for l in lenses)
    with Daemon(bins,files) as daemon:
        daemon.wait_connected()
        client=daemon.client()
        for l in lenses:
            if getattr(l,"cal",None): client.call("Calibrate",lens=l.name,toml=l.cal)
            client.call("Move",lens=l.name,axis="focus",target={"position":float(rnd.randrange(l.steps))})
            client.call("Move",lens=l.name,axis="iris",target={"position":float(rnd.randrange(l.isteps))})
            if l.zoom: client.call("Move",lens=l.name,axis="zoom",target={"focalLengthMm":l.zoomgoal})
            answer=client.call("Plan",lens=l.name,request=Request(l),apply=True)
            status=client.call("Status",lens=l.name)["lenses"][0]
            axes={a["axis"]:a for a in status["axes"]}
            zoom=axes["zoom"]["position"] if l.zoom else l.f0
            if not answer["plan"]["feasible"]:
                report.check("refused with a conflict or nearest", bool(answer["plan"].get("conflict")), json.dumps(answer)[:300])
                continue
            reached=answer["reached"]
            kind=l.kind+(", approach far" if l.approach=="far" and l.fbl else "")
            where="approach %s, focus backlash %d, iris backlash %d"%(l.approach,l.fbl,l.ibl)
            for lim,said in zip(l.lims,reached["limits"]):
                # counts of a simulated lens are true when last moved outward; moved inward the mechanism is the backlash ahead
                p=axes["focus"]["position"]+(l.fbl if l.approach=="far" else 0)
                k=axes["iris"]["position"]
                places=[p]+([p+Untaken(answer["applied"],"focus")] if l.approach=="near" else [])
                true=max(Worst(l,lim,zoom,q,k+j) for q in places for j in (0,Untaken(answer["applied"],"iris")))
                report.check(kind+": reached.feasible is true", not reached["feasible"] or true<=1.02,
                    "%s %s limit %.4g um: true ratio %.4f, said %.4f; %s"%(l.name,lim["kind"],lim["limitUm"],true,said["ratio"],where))
            for key in ("extensionMm","fNumber","focalLengthMm"):
                report.check("reached has Status' "+key, abs(reached[key]-status[key])<=1e-6*max(1,abs(status[key])), "%s %s %s"%(l.name,reached[key],status[key]))
            report.check("Status: f-number of the scene", abs(status["fNumber"]-NN(l,axes["iris"]["position"]))<=1e-6*status["fNumber"], "%s"%status)
            report.check("Status: focal length of the scene", abs(status["focalLengthMm"]-F(l,zoom,E(l,axes["focus"]["position"])))<=1e-5*status["focalLengthMm"], "%s"%status)
sys.exit(report.end())

#!/usr/bin/env python3
"""Time against error, renderer beside renderer, on the same glTF files.

usage: bench.py SCENES_DIR REFS_DIR OUT.json [--only cornell,..] [--peers mitsuba-llvm,mitsuba-scalar,cycles]
                [--cmd 'NAME={py} {here}/render_prt.py prt-batch {scene} {out} {spp} {size} {bounces} {seed}'] ...
                [--spp 1,4,16,64,256] [--size 256] [--reps 3] [--lock FILE] [--table]

In a command template {scene} {out} {spp} {w} {h} {size} {bounces} {seed} {py} {here} are filled in.
It must write a linear EXR to {out}; whatever it prints is ignored but for a last line that is a JSON
object (render_s, load_s, import_s: kept).  Wall and CPU time are taken from outside, the whole process
(cpu s is the figure to trust when something else runs on the machine).
Runs shorter than 4 s are repeated --reps times with other seeds: median time, mean relMSE.
relMSE has the reference's own noise (stats.json rel_se^2) taken off.  REFS_DIR/NAME/ref_mitsuba.exr or
ref_spec.exr is the reference, else ref_cycles.exr.
"""
import argparse, fcntl, json, os, resource, shlex, statistics as S, subprocess, sys, tempfile, time
HERE = os.path.dirname(os.path.abspath(__file__)); sys.path.insert(0, HERE)
from compare_exr import compare, read_exr
PEERS = {"mitsuba-llvm": "{py} {here}/render_mitsuba.py {scene} {out} --spp {spp} --size {size} --bounces {bounces} --seed {seed}",
         "mitsuba-llvm-spec": "{py} {here}/render_mitsuba.py {scene} {out} --spp {spp} --size {size} --bounces {bounces} --seed {seed} --bsdf spec",
         "mitsuba-scalar": "{py} {here}/render_mitsuba.py {scene} {out} --spp {spp} --size {size} --bounces {bounces} --seed {seed} --variant scalar_rgb",
         "cycles": "{py} {here}/render_cycles.py {scene} {out} --spp {spp} --size {size} --bounces {bounces} --seed {seed}",
         "cycles-oidn": "{py} {here}/render_cycles.py {scene} {out} --spp {spp} --size {size} --bounces {bounces} --seed {seed} --denoise"}


def table(rows):
    out = ["| scene | renderer | spp | total s | cpu s | render s | start+load s | relMSE | relMSE trim | FLIP | relMSE x render s |", "|---|---|---|---|---|---|---|---|---|---|---|"]
    for r in rows:
        rs = r.get("render_s"); f = lambda x, p: "-" if x is None else format(x, p)
        out.append(f"| {r['scene']} | {r['renderer']} | {r['spp']} | {r['wall_s']:.2f} | {f(r.get('cpu_s'), '.2f')} | {f(rs, '.2f')} | {f(None if rs is None else r['wall_s'] - rs, '.2f')} | {r['relmse']:.3g} | {r['relmse_trim']:.3g} | {f(r.get('flip'), '.3f')} | {f(None if rs is None else r['relmse'] * rs, '.3g')} |")
    return "\n".join(out)


if __name__ == "__main__":
    ap = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ap.add_argument("scenes"); ap.add_argument("refs"); ap.add_argument("out"); ap.add_argument("--only", default="cornell,punctual,quad_plane")
    ap.add_argument("--peers", default="mitsuba-llvm,mitsuba-scalar,cycles"); ap.add_argument("--cmd", action="append", default=[])
    ap.add_argument("--spp", default="1,4,16,64,256"); ap.add_argument("--size", type=int, default=256); ap.add_argument("--reps", type=int, default=3); ap.add_argument("--bounces", type=int, default=32)
    ap.add_argument("--lock", default=os.path.join(tempfile.gettempdir(), "bench.lock")); ap.add_argument("--table", action="store_true"); ap.add_argument("--max-s", type=float, default=60, help="skip a step whose predicted time is longer"); ap.add_argument("--keep", help="folder that keeps the EXRs")
    a = ap.parse_args()
    todo = {n: PEERS[n] for n in a.peers.split(",") if n}; todo.update(c.split("=", 1) for c in a.cmd)
    rows = json.load(open(a.out)) if os.path.exists(a.out) else []
    have = {(r["scene"], r["renderer"], r["spp"]) for r in rows}; tmp = a.keep or tempfile.mkdtemp(); os.makedirs(tmp, exist_ok=True)
    for sc in a.only.split(","):
        g = os.path.join(a.scenes, sc, sc + ".gltf"); d = os.path.join(a.refs, sc); rn = next((n for n in ("ref_mitsuba", "ref_spec", "ref_cycles") if os.path.exists(f"{d}/{n}.exr")), None)
        if rn is None: print(sc, "has no reference yet", file=sys.stderr); continue
        R = read_exr(f"{d}/{rn}.exr"); own = json.load(open(d + "/stats.json")).get(rn, {}).get("rel_se", 0) ** 2 if os.path.exists(d + "/stats.json") else 0
        for name, tpl in todo.items():
            last = (0, 0)
            for spp in map(int, a.spp.split(",")):
                if (sc, name, spp) in have: continue
                if last[1] * spp / max(last[0], 1) > a.max_s: continue
                t, cpu, e, et, fl, js = [], [], [], [], [], []
                for k in range(a.reps):
                    o = os.path.join(tmp, f"{sc}_{name}_{spp}_{k}.exr")
                    cmd = shlex.split(tpl.format(scene=g, out=o, spp=spp, w=a.size, h=a.size, size=f"{a.size}x{a.size}", bounces=a.bounces, seed=7 + k, py=sys.executable, here=HERE))
                    with open(a.lock, "a") as lk:
                        fcntl.flock(lk, fcntl.LOCK_EX); u0 = resource.getrusage(resource.RUSAGE_CHILDREN); t0 = time.perf_counter()
                        p = subprocess.run(cmd, capture_output=True, text=True); t.append(time.perf_counter() - t0)
                    u1 = resource.getrusage(resource.RUSAGE_CHILDREN); cpu.append(u1.ru_utime + u1.ru_stime - u0.ru_utime - u0.ru_stime)
                    if p.returncode or not os.path.exists(o): print(sc, name, "FAILED", p.stderr[-500:], file=sys.stderr); break
                    try: js.append(json.loads(p.stdout.strip().splitlines()[-1]))
                    except (ValueError, IndexError): pass
                    c = compare([read_exr(o)], [R], flip=True); e.append(c["relmse"] - own); et.append(c["relmse_trim"] - own); fl.append(c["flip"])
                    if not a.keep: os.remove(o)
                    if t[-1] > 4: break
                if not e: break
                r = {"scene": sc, "renderer": name, "spp": spp, "reps": len(e), "wall_s": S.median(t), "wall_all": t, "cpu_s": S.median(cpu), "load1": os.getloadavg()[0], "relmse": S.mean(e), "relmse_trim": S.mean(et), "flip": None if fl[0] is None else S.mean(fl), "ref": rn}
                for k in ("render_s", "load_s", "import_s", "sync_s"):
                    v = [j[k] for j in js if isinstance(j.get(k), (int, float))]
                    if v: r[k] = S.median(v)
                rows.append(r); last = (spp, r["wall_s"]); json.dump(rows, open(a.out, "w"), indent=1); print(table([r]).splitlines()[-1], flush=True)
    if a.table: print(table(rows))

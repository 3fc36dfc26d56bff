mod common;
use common::{Component, Offline, gpu};
use lightfall::frame::{Settings, TracerKind};
use lightfall::resource::{Photon, PhotonState};
use lightfall::scene::samples;
#[test]
fn probe() {
    let gpu = gpu().unwrap();
    for imp in [0.0, 0.8] {
        let settings = Settings { frames: 1, photons: 200_000, bounces: 3, emission_importance: imp, tracer_kind: TracerKind::Bvh, ..Settings::fast() };
        let mut o = Offline::new(&gpu, samples::two_rooms(1.0), &settings, 0, [128, 128], Component::Indirect).unwrap();
        for _ in 0..9 { o.render_frame(None).unwrap(); }
        let p: Vec<Photon> = lightfall::read_buffer_blocking(&gpu.device, &gpu.queue, o.renderer.photons().unwrap().buffer()).unwrap();
        let n = 200_000;
        if let Some(c) = o.renderer.emission_cells() {
            let t: Vec<f32> = lightfall::read_buffer_blocking(&gpu.device, &gpu.queue, c.tables()).unwrap();
            let (cols, rows) = t[..272].split_at(16);
            let step = |e: &[f32], i: usize| e[i] - if i == 0 { 0.0 } else { e[i - 1] };
            let mut d: Vec<f32> = (0..256).map(|i| 256.0 * step(cols, i / 16) * step(&rows[i / 16 * 16..], i % 16)).collect();
            d.sort_by(f32::total_cmp);
            println!("emission cells {:?}", [0, 64, 128, 192, 240, 250, 253, 255].map(|i| d[i]));
            let t: Vec<f32> = lightfall::read_buffer_blocking(&gpu.device, &gpu.queue, c.reflection_tables()).unwrap();
            let mut d: Vec<f32> = (0..256).flat_map(|c| { let (cols, rows) = t[20 * c..][..20].split_at(4); let (cols, rows) = (cols.to_vec(), rows.to_vec()); (0..16).map(move |i| 16.0 * step(&cols, i / 4) * step(&rows[i / 4 * 4..], i % 4)) }).collect();
            d.sort_by(f32::total_cmp);
            println!("reflections {:?}", [0, 1024, 2048, 3072, 3800, 4000, 4050, 4095].map(|i| d[i]));
        }

        // frame transform: unit; find z of wall through z range
        let zs: Vec<f32> = p.iter().filter(|q| q.state() == PhotonState::Stored).map(|q| q.position[2]).collect();
        let (lo, hi) = zs.iter().fold((9f32, -9f32), |(a, b), &z| (a.min(z), b.max(z)));
        let mid = 0.5 * (lo + hi);
        for hop in 0..4 {
            let h = &p[hop * n..][..n];
            let far: Vec<&Photon> = h.iter().filter(|q| q.state() == PhotonState::Stored && q.position[2] > mid + 0.02 * (hi - lo)).collect();
            let flux: f64 = far.iter().map(|q| f64::from(q.flux[1])).sum();
            let sq: f64 = far.iter().map(|q| f64::from(q.flux[1]).powi(2)).sum();
            let mut b: Vec<f32> = far.iter().map(|q| q.emission_boost()).collect();
            b.sort_by(f32::total_cmp);
            println!("imp {imp} hop {hop}: {} far, flux {flux:.4e}, effective {:.0}, boost quartiles {:?}", far.len(), flux * flux / sq, [0.1,0.25, 0.5, 0.75,0.9].map(|q| b.get((q * b.len() as f64) as usize).copied()));
        }
    }
}

//! A scene on the GPU: its rays, what they truly meet, environment maps of it, and the tracers.

use super::common::adapter::Gpu;
use super::common::sequence::Sequence;
use super::judge::Truth;
use lightfall::frame::{GiRenderer, SceneInputs, Settings, TracerKind};
use lightfall::glam::{DVec3, Vec3};
use lightfall::pass::{
    BvhTracer, BvhTracerRayInputs, BvhTracerResources, DepthHierarchyBuild, DepthHierarchyBuildInputs,
    DepthHierarchyBuildResources, EnvMapCapture, EnvMapCaptureInputs, EnvMapCaptureResources, ImageSpaceTracer,
    ImageSpaceTracerRayInputs, ImageSpaceTracerResources, ImageSpaceTracerSettings, RayQuery,
};
use lightfall::resource::{
    BvhGeometry, BvhGeometryConfig, CapturePurpose, CaptureView, DepthHierarchy, EnvMaps, Geometry as _, MeshGeometry,
    Photon, PhotonState, PrepareContext, Ray, RayHit, Rays, SurfaceHit, SurfaceRay, SurfaceRays,
};
use lightfall::scene::{Scene, SceneSummary, UnitFrame};
use lightfall::{Error, wgpu};

/// Rays leave a surface from this far above it, unit frame: as the tracers do.
const OFFSET: f32 = 1.0 / 4096.0;
/// Scatterings of the paths whose vertices the rays leave from.
pub(crate) const BOUNCES: u32 = 3;

/// A scene, and what is known of it.
pub(crate) struct Bench<'a> {
    pub(crate) gpu: &'a Gpu,
    pub(crate) scene: Scene,
    pub(crate) geometry: MeshGeometry,
    pub(crate) bvh: BvhGeometry,
    pub(crate) frame: UnitFrame,
    /// Of the scene's box, unit frame.
    pub(crate) diagonal: f32,
    bvh_tracer: BvhTracer,
}

/// Environment maps, captured, with their hierarchies.
pub(crate) struct Maps {
    pub(crate) maps: EnvMaps,
    pub(crate) hierarchy: DepthHierarchy,
    /// Milliseconds to capture them and to build the hierarchies, on the wall.
    pub(crate) capture_ms: f64,
    pub(crate) build_ms: f64,
}

impl<'a> Bench<'a> {
    pub(crate) fn new(gpu: &'a Gpu, scene: Scene) -> Result<Self, Error> {
        let Gpu { device, queue, .. } = gpu;
        let summary = SceneSummary::of(&scene)?;
        let frame = UnitFrame::new(&summary.bounds, summary.total_flux)?;
        let mut bvh = BvhGeometry::new(device, queue, &scene, &BvhGeometryConfig::default())?;
        bvh.prepare(queue, &frame)?;
        Ok(Self {
            gpu,
            geometry: MeshGeometry::new(device, queue, &scene)?,
            bvh,
            frame,
            diagonal: 2.0 * frame.radius(),
            bvh_tracer: BvhTracer::new(device),
            scene,
        })
    }

    /// All hops of photons that are traced one way or another, with maps at these places if there are any.
    pub(crate) fn photons(&mut self, settings: &Settings, centers: &[Vec3]) -> Result<Vec<Photon>, Error> {
        let Gpu { device, queue, .. } = self.gpu;
        let mut renderer = GiRenderer::new(device, settings)?;
        let summary = SceneSummary::of(&self.scene)?;
        renderer.set_scene(queue, &summary, &self.scene.lights)?;
        if !centers.is_empty() {
            let world: Vec<DVec3> = centers.iter().map(|&c| self.frame.world_point(c)).collect();
            renderer.set_env_map_centers(queue, &world)?;
        }
        renderer.prepare(queue, &mut self.geometry, &mut [])?;
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let inputs = SceneInputs {
            queue,
            geometry: &self.geometry,
            bvh: Some(&self.bvh),
            sample_offset: 0,
            timestamps: None,
        };
        renderer.record_scene(&mut encoder, &inputs)?;
        queue.submit([encoder.finish()]);
        match renderer.photons() {
            Some(photons) => lightfall::read_buffer_blocking(device, queue, photons.buffer()),
            None => Ok(Vec::new()),
        }
    }

    /// Rays of diffuse light from where light that has bounced at least once arrives.
    pub(crate) fn rays(&mut self, count: usize) -> Result<Vec<SurfaceRay>, Error> {
        // Of a sun's photons most may miss what there is to see.
        let paths = 8 * (count as u32).div_ceil(BOUNCES) + 10_000;
        let settings = Settings {
            tracer_kind: TracerKind::Bvh,
            bounces: BOUNCES,
            photons: paths,
            ..Settings::balanced()
        };
        let photons = self.photons(&settings, &[])?;
        let stored: Vec<_> = photons[paths as usize..]
            .iter()
            .filter(|p| p.state() == PhotonState::Stored)
            .collect();
        let mut random = Sequence::default();
        let stride = (stored.len() as f64 / count as f64).max(1.0);
        let picked = (0..count).map_while(|i| stored.get((i as f64 * stride) as usize));
        Ok(picked
            .map(|photon| {
                let normal = Photon::unpack_unit_vector(photon.normal);
                // The sum of a normal and a point of the unit sphere is distributed by the cosine.
                let direction = (normal.as_dvec3() + random.direction()).normalize().as_vec3();
                SurfaceRay::new(photon.position.into(), normal, direction)
            })
            .collect())
    }

    /// What rays truly meet: `None` for nothing.
    pub(crate) fn truths(&self, rays: &[SurfaceRay]) -> Result<Vec<Option<Truth>>, Error> {
        let list: Vec<_> = rays
            .iter()
            .map(|ray| Ray {
                origin: (Vec3::from(ray.position) + OFFSET * Photon::unpack_unit_vector(ray.normal)).to_array(),
                furthest: Ray::FURTHEST,
                direction: ray.direction,
                mask: Ray::IN_ENV_MAPS,
            })
            .collect();
        let hits = self.trace_triangles(&list, RayQuery::Closest)?;
        let truth = |(ray, hit): (&Ray, &RayHit)| {
            hit.is_hit().then(|| Truth {
                distance: hit.distance,
                normal: self.normal(hit, ray.direction.into()),
            })
        };
        Ok(list.iter().zip(&hits).map(truth).collect())
    }

    /// By triangles, which centres see the front of surfaces at these points: a bit for each, of up to 32.
    pub(crate) fn seen_from(&self, points: &[(Vec3, Vec3)], centers: &[Vec3]) -> Result<Vec<u32>, Error> {
        let mut seen = vec![0; points.len()];
        for (bit, &center) in centers.iter().enumerate() {
            let sight = |&(point, normal): &(Vec3, Vec3)| {
                let origin = point + OFFSET * normal;
                Ray {
                    origin: origin.to_array(),
                    furthest: 1.0,
                    direction: (center - origin).to_array(),
                    mask: Ray::IN_ENV_MAPS,
                }
            };
            let rays: Vec<_> = points.iter().map(sight).collect();
            let hits = self.trace_triangles(&rays, RayQuery::Any)?;
            for ((bits, hit), (ray, point)) in seen.iter_mut().zip(&hits).zip(rays.iter().zip(points)) {
                let faces = Vec3::from(ray.direction).dot(point.1) > 0.0;
                *bits |= u32::from(faces && !hit.is_hit()) << bit;
            }
        }
        Ok(seen)
    }

    fn trace_triangles(&self, rays: &[Ray], query: RayQuery) -> Result<Vec<RayHit>, Error> {
        let Gpu { device, queue, .. } = self.gpu;
        let list = Rays::new(device, rays.len() as u32)?;
        list.write(queue, rays)?;
        let mut resources = BvhTracerResources::new(device)?;
        let mut encoder = device.create_command_encoder(&Default::default());
        let inputs = BvhTracerRayInputs {
            queue,
            geometry: &self.bvh,
            rays: &list,
            query,
            timestamps: None,
        };
        self.bvh_tracer.record_rays(&mut encoder, &mut resources, &inputs);
        queue.submit([encoder.finish()]);
        let mut hits: Vec<RayHit> = lightfall::read_buffer_blocking(device, queue, list.hits())?;
        hits.truncate(rays.len());
        Ok(hits)
    }

    /// Geometric normal on the side that a ray hits.
    fn normal(&self, hit: &RayHit, direction: Vec3) -> Vec3 {
        let instance = &self.scene.instances[hit.instance as usize];
        let mesh = &self.scene.meshes[instance.mesh];
        let corner = |k: usize| {
            let vertex = mesh.indices[3 * hit.triangle as usize + k];
            let position = Vec3::from(mesh.positions[vertex as usize]).as_dvec3();
            instance.transform.transform_point3(position)
        };
        let [a, b, c] = [0, 1, 2].map(corner);
        let normal = (b - a).cross(c - a).normalize_or(DVec3::Y).as_vec3();
        -normal.dot(direction).signum() * normal
    }

    /// Lets the geometry prepare for views, and numbers them.
    pub(crate) fn prepare(&mut self, views: &mut [CaptureView]) -> Result<(), Error> {
        for (index, view) in (0..).zip(views.iter_mut()) {
            view.index = index;
        }
        let context = PrepareContext {
            device: &self.gpu.device,
            queue: &self.gpu.queue,
            frame: &self.frame,
        };
        self.geometry.prepare(&context, views)
    }

    /// Maps of `size`² texels a face at these places.
    pub(crate) fn capture(&mut self, centers: &[Vec3], size: u32) -> Result<Maps, Error> {
        let Gpu { device, queue, .. } = self.gpu;
        let mut maps = EnvMaps::new(device, centers.len() as u32, size)?;
        maps.set_centers(queue, centers)?;
        let hierarchy = DepthHierarchy::new(device, &maps)?;
        let mut views: Vec<_> = maps.views(CapturePurpose::EnvMap).collect();
        self.prepare(&mut views)?;
        let mut capture = EnvMapCaptureResources::new(device, size)?;
        let mut build = DepthHierarchyBuildResources::new(device, &maps)?;
        let capture_inputs = EnvMapCaptureInputs {
            env_maps: &maps,
            geometry: &self.geometry,
            views: &views,
            layers: None,
            timestamps: None,
        };
        let build_inputs = DepthHierarchyBuildInputs {
            queue,
            env_maps: &maps,
            hierarchy: &hierarchy,
            maps: None,
            timestamps: None,
        };
        let builder = DepthHierarchyBuild::new(device);
        let capture_ms = self.time(|encoder| {
            EnvMapCapture::new().record(encoder, &mut capture, &capture_inputs);
            Ok(())
        })?;
        let build_ms = self.time(|encoder| {
            builder.record(encoder, &mut build, &build_inputs);
            Ok(())
        })?;
        Ok(Maps {
            maps,
            hierarchy,
            capture_ms,
            build_ms,
        })
    }

    /// Milliseconds on the wall that recorded work takes: the shorter of two times, because the first also compiles.
    pub(crate) fn time(
        &self,
        mut record: impl FnMut(&mut wgpu::CommandEncoder) -> Result<(), Error>,
    ) -> Result<f64, Error> {
        let Gpu { device, queue, .. } = self.gpu;
        let mut shortest = f64::INFINITY;
        for _ in 0..2 {
            let mut encoder = device.create_command_encoder(&Default::default());
            record(&mut encoder)?;
            let start = std::time::Instant::now();
            queue.submit([encoder.finish()]);
            super::common::offline::wait(device)?;
            shortest = shortest.min(start.elapsed().as_secs_f64() * 1e3);
        }
        Ok(shortest)
    }

    /// What maps say of rays, and the milliseconds it takes.
    pub(crate) fn trace(
        &self,
        tracer: &ImageSpaceTracer,
        settings: &ImageSpaceTracerSettings,
        maps: &Maps,
        rays: &[SurfaceRay],
    ) -> Result<(Vec<SurfaceHit>, f64), Error> {
        let Gpu { device, queue, .. } = self.gpu;
        let list = SurfaceRays::new(device, rays.len() as u32)?;
        list.write(queue, rays)?;
        let mut resources = ImageSpaceTracerResources::new(device)?;
        let inputs = ImageSpaceTracerRayInputs {
            queue,
            env_maps: &maps.maps,
            hierarchy: Some(&maps.hierarchy),
            rays: &list,
            settings,
            timestamps: None,
        };
        let ms = self.time(|encoder| tracer.record_rays(encoder, &mut resources, &inputs))?;
        let mut hits: Vec<SurfaceHit> = lightfall::read_buffer_blocking(device, queue, list.hits())?;
        hits.truncate(rays.len());
        Ok((hits, ms))
    }
}

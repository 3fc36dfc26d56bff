//! What all views share of indirect light: photons, and what the settings let them meet.

#[cfg(all(feature = "bvh", not(target_arch = "wasm32")))]
use super::PhotonFeeder;
use super::hemisphere_scene::{DrawInputs, HemisphereScene};
use super::illumination_scene::IlluminationScene;
use super::surface_light_scene::SurfaceLightScene;
use super::traced_photons::{TracedPhotons, WalkInputs};
use super::{GlossyMethod, IndirectMethod, SceneInputs, Settings, TracerKind};
use crate::Error;
#[cfg(feature = "bvh")]
use crate::pass::BvhTracer;
use crate::pass::{
    Bandwidth, DepthHierarchyBuild, DepthHierarchyBuildInputs, DepthHierarchyBuildResources, EnvMapCapture,
    EnvMapCaptureInputs, EnvMapCaptureResources, EnvMapLighting, EnvMapLightingInputs, EnvMapLightingResources,
    EnvMapLightingSettings, FirstHits, Guiding, GuidingUpdateInputs, GuidingUpdateResources, HemisphereGather,
    ImageSpaceTracer, PhotonEmitter, PhotonGrid, PhotonGridInputs, PhotonGridResources, PhotonGuiding, PhotonSpread,
    PhotonStream, SelectiveEmitter, SortedPhotons, TexelGather,
};
use crate::resource::{
    CaptureView, DepthHierarchy, EnvMapIrradiance, EnvMaps, Geometry, GuidingTables, Lights, PhotonGroups, PhotonMap,
    PhotonTargets, Photons, ShadowMaps,
};
use crate::scene::{BoundingSphere, SurfacePlace, UnitFrame};

/// From the lights to the last surface.
#[derive(Debug)]
pub(super) struct PhotonPasses {
    env_map_capture: EnvMapCapture,
    /// If the method needs it.
    depth_hierarchy_build: Option<DepthHierarchyBuild>,
    /// If the settings use it.
    pub(super) photon_guiding: Option<PhotonGuiding>,
    pub(super) photon_emitter: PhotonEmitter,
    /// If photons stay until their way changes.
    pub(super) selective_emitter: Option<SelectiveEmitter>,
    /// Those that the settings use.
    pub(super) image_space_tracer: Option<ImageSpaceTracer>,
    #[cfg(feature = "bvh")]
    pub(super) bvh_tracer: Option<BvhTracer>,
    /// If light is gathered from there.
    env_map_lighting: Option<EnvMapLighting>,
    /// If light comes from surface lights, or is kept at texels.
    pub(super) photon_stream: Option<PhotonStream>,
    /// If it comes from illumination maps.
    pub(super) texel_gather: Option<TexelGather>,
    /// If the host's draws gather there.
    pub(super) hemisphere_gather: Option<HemisphereGather>,
    photon_grid: PhotonGrid,
    /// If the settings light rough metal by photons.
    glossy_grid: Option<PhotonGrid>,
}

/// Allocated while there is indirect light.
#[derive(Debug)]
pub(super) struct IndirectScene {
    global: TracedPhotons,
    /// If photons are guided.
    guiding: Option<(GuidingTables, GuidingUpdateResources)>,
    image_space: Option<ImageSpaceScene>,
    /// If light comes from there.
    surface_lights: Option<SurfaceLightScene>,
    /// If light is kept at texels.
    illumination: Option<Box<IlluminationScene>>,
    /// While caustics have photons of their own, and what these are aimed at.
    caustics: Option<(TracedPhotons, PhotonTargets)>,
    /// While anything specular may be seen.
    grid: Option<PhotonGridResources>,
    /// While rough metal is lit by photons.
    glossy_grid: Option<PhotonGridResources>,
}

/// Allocated while rays are traced, or light is gathered, in image space.
#[derive(Debug)]
struct ImageSpaceScene {
    env_maps: EnvMaps,
    capture: EnvMapCaptureResources,
    /// If the method needs it.
    hierarchy: Option<(DepthHierarchy, DepthHierarchyBuildResources)>,
    /// If light is gathered.
    lighting: Option<(EnvMapIrradiance, EnvMapLightingResources)>,
}

/// What recording needs beside a host's inputs.
#[derive(Clone, Copy)]
pub(super) struct PhotonInputs<'a> {
    pub(super) scene: &'a SceneInputs<'a>,
    pub(super) settings: &'a Settings,
    pub(super) lights: &'a Lights,
    pub(super) shadow_maps: &'a ShadowMaps,
    /// Of the environment maps to capture.
    pub(super) views: &'a [CaptureView],
    /// The layers that these are of.
    pub(super) layers: &'a [u32],
    /// Of texels that the host's draws gather.
    pub(super) hemisphere_views: &'a [CaptureView],
    /// Whether it is time to look where photons are seen.
    pub(super) updates_guiding: bool,
    /// Of lights and geometry.
    pub(super) revision: u64,
    /// What brings photons instead of tracers, for surface lights.
    #[cfg(all(feature = "bvh", not(target_arch = "wasm32")))]
    pub(super) feeder: Option<&'a PhotonFeeder>,
    /// That photons are of.
    pub(super) frame: &'a UnitFrame,
    /// Of all surfaces, unit frame.
    pub(super) area: f32,
    /// Of the region, unit frame.
    pub(super) radius: f32,
}

impl PhotonPasses {
    pub(super) fn new(device: &wgpu::Device, settings: &Settings) -> Self {
        let (kind, method) = (settings.tracer_kind, settings.trace_method);
        let grid = |sorted| PhotonGrid::new(device, sorted, settings.splatter_config.keeps_to_surfaces);
        Self {
            env_map_capture: EnvMapCapture::new(),
            depth_hierarchy_build: settings.needs_hierarchy().then(|| DepthHierarchyBuild::new(device)),
            photon_guiding: (settings.guided_photons > 0.0).then(|| PhotonGuiding::new(device)),
            photon_emitter: PhotonEmitter::new(device),
            selective_emitter: settings.selects_photons().then(|| SelectiveEmitter::new(device)),
            image_space_tracer: kind.uses_env_maps().then(|| ImageSpaceTracer::new(device, method)),
            #[cfg(feature = "bvh")]
            bvh_tracer: kind.uses_triangles().then(|| BvhTracer::new(device)),
            env_map_lighting: (settings.indirect_method == IndirectMethod::FinalGather).then(|| {
                let config = &settings.splatter_config;
                EnvMapLighting::new(device, config.kernel, config.keeps_to_surfaces)
            }),
            photon_stream: settings.indirect_method.has_places().then(|| PhotonStream::new(device)),
            texel_gather: (settings.indirect_method == IndirectMethod::IlluminationMaps)
                .then(|| TexelGather::new(device)),
            hemisphere_gather: settings.gathers_by_draws().then(|| HemisphereGather::new(device)),
            photon_grid: grid(SortedPhotons::OnDiffuse),
            glossy_grid: (settings.glossy_method == GlossyMethod::Photons).then(|| grid(SortedPhotons::OnGlossy)),
        }
    }
}

impl IndirectScene {
    pub(super) fn new(device: &wgpu::Device, queue: &wgpu::Queue, settings: &Settings) -> Result<Self, Error> {
        let kind = match settings.tracer_kind {
            // What is traced again would differ by tracers.
            TracerKind::Hybrid if settings.selects_photons() => TracerKind::Bvh,
            kind => kind,
        };
        let mut global = TracedPhotons::new(
            device,
            (settings.traced_photons(), settings.walked_bounces()),
            (PhotonMap::All, kind),
        )?;
        if settings.selects_photons() {
            global.select(device, settings)?;
        }
        let image_space = || {
            let env_maps = EnvMaps::new(
                device,
                settings.env_map_count + settings.env_maps_at_lights,
                settings.env_map_size,
            )?;
            let hierarchy = || {
                Ok((
                    DepthHierarchy::new(device, &env_maps)?,
                    DepthHierarchyBuildResources::new(device, &env_maps)?,
                ))
            };
            let lighting = || {
                Ok((
                    EnvMapIrradiance::new(device, &env_maps, settings.final_gather.map_size)?,
                    EnvMapLightingResources::new(device, &global.photons)?,
                ))
            };
            let gathers = settings.indirect_method == IndirectMethod::FinalGather;
            Ok(ImageSpaceScene {
                lighting: gathers.then(lighting).transpose()?,
                hierarchy: settings.needs_hierarchy().then(hierarchy).transpose()?,
                env_maps,
                capture: EnvMapCaptureResources::new(device, settings.env_map_size)?,
            })
        };
        let guiding = || {
            let tables = GuidingTables::new(device, queue)?;
            Ok((tables, GuidingUpdateResources::new(device)?))
        };
        Ok(Self {
            guiding: (settings.guided_photons > 0.0).then(guiding).transpose()?,
            image_space: settings.needs_env_maps().then(image_space).transpose()?,
            surface_lights: (settings.indirect_method == IndirectMethod::SurfaceLights)
                .then(|| SurfaceLightScene::new(device, settings))
                .transpose()?,
            illumination: (settings.indirect_method == IndirectMethod::IlluminationMaps)
                .then(|| IlluminationScene::new(device, queue, settings).map(Box::new))
                .transpose()?,
            caustics: None,
            grid: None,
            glossy_grid: None,
            global,
        })
    }

    /// Forgets lights and shadow maps that are no more.
    pub(super) fn renew_emitter(&mut self, device: &wgpu::Device) -> Result<(), Error> {
        if let Some((caustics, _)) = &mut self.caustics {
            caustics.renew_emitter(device)?;
        }
        self.global.renew_emitter(device)
    }

    /// Gives caustics photons of their own, or none.
    pub(super) fn split_caustics(
        &mut self,
        gpu: (&wgpu::Device, &wgpu::Queue),
        settings: &Settings,
        is_wanted: bool,
    ) -> Result<(), Error> {
        if !is_wanted {
            self.caustics = None;
        } else if self.caustics.is_none() {
            let (device, kind) = (gpu.0, settings.caustic_tracer());
            let mut traced = TracedPhotons::new(
                device,
                (settings.caustic.photons, settings.bounces),
                (PhotonMap::Caustic, kind),
            )?;
            if settings.caustic.rounds > 1 {
                traced.trace_in_rounds(gpu, settings.caustic.rounds)?;
            }
            self.caustics = Some((traced, PhotonTargets::new(device)?));
        }
        let is_split = self.caustics.is_some();
        let map = if is_split { PhotonMap::Global } else { PhotonMap::All };
        if self.global.photons.map() != map {
            self.global.photons.set_map(map);
            self.global.retrace();
        }
        Ok(())
    }

    /// Says what caustic photons are aimed at.
    pub(super) fn aim_caustics(
        &mut self,
        queue: &wgpu::Queue,
        frame: &UnitFrame,
        lights: &Lights,
        targets: &[BoundingSphere],
    ) {
        if let Some((traced, own)) = &mut self.caustics {
            own.write(queue, frame, lights, targets, traced.photons.count());
        }
    }

    /// Keeps photons sorted, or not: those on diffuse surfaces, and those on rough metal.
    pub(super) fn sort_photons(&mut self, device: &wgpu::Device, [diffuse, glossy]: [bool; 2]) -> Result<(), Error> {
        for (grid, is_wanted, sorted) in [
            (&mut self.grid, diffuse, SortedPhotons::OnDiffuse),
            (&mut self.glossy_grid, glossy, SortedPhotons::OnGlossy),
        ] {
            if !is_wanted {
                *grid = None;
            } else if grid.is_none() {
                *grid = Some(PhotonGridResources::new(device, &self.global.photons, sorted)?);
            }
        }
        Ok(())
    }

    /// All but caustics, where these have photons of their own.
    pub(super) fn photons(&self) -> &Photons {
        &self.global.photons
    }

    /// Has all photons traced as a whole in the next frame, even if they stay until their way changes or their turn comes.
    pub(super) fn retrace(&mut self) {
        self.global.retrace();
        if let Some((caustics, _)) = &mut self.caustics {
            caustics.retrace();
        }
    }

    /// Has all light at texels forgotten and gathered anew.
    pub(super) fn restart_illumination(&mut self) {
        if let Some(illumination) = &mut self.illumination {
            illumination.restart();
            self.global.retrace();
        }
    }

    /// In groups, if photons stay until their way changes.
    pub(super) fn photon_groups(&self) -> Option<&PhotonGroups> {
        self.global.groups()
    }

    /// Traces so many photons from now on, of those that there is room for.
    pub(super) fn stream(&mut self, count: u32) -> Result<(), Error> {
        self.global.set_count(count)
    }

    pub(super) fn surface_lights(&self) -> Option<&SurfaceLightScene> {
        self.surface_lights.as_ref()
    }

    pub(super) fn surface_lights_mut(&mut self) -> Option<&mut SurfaceLightScene> {
        self.surface_lights.as_mut()
    }

    pub(super) fn illumination(&self) -> Option<&IlluminationScene> {
        self.illumination.as_deref()
    }

    /// If the host's draws gather light at texels.
    pub(super) fn hemispheres_mut(&mut self) -> Option<&mut HemisphereScene> {
        self.illumination.as_deref_mut()?.hemispheres_mut()
    }

    /// Records what was planned of these, outside of a frame.
    pub(super) fn record_hemispheres(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        passes: &PhotonPasses,
        (queue, geometry, views): (&wgpu::Queue, &dyn Geometry, &[CaptureView]),
    ) -> Result<(), Error> {
        let draw_inputs = DrawInputs {
            queue,
            passes,
            geometry,
            views,
            timestamps: None,
        };
        match &mut self.illumination {
            Some(illumination) => illumination.record_draws(encoder, &draw_inputs),
            None => Ok(()),
        }
    }

    /// Puts surface lights, or texels, where they stand this frame.
    pub(super) fn follow_places(
        &mut self,
        gpu: (&wgpu::Device, &wgpu::Queue),
        (frame, settings): (&UnitFrame, &Settings),
        places: &[SurfacePlace],
    ) -> Result<(), Error> {
        if let Some(lights) = &mut self.surface_lights {
            lights.follow(gpu, frame, places)?;
        }
        if let Some(illumination) = &mut self.illumination
            && illumination.follow(gpu, (frame, settings), places)?
        {
            self.global.retrace();
        }
        Ok(())
    }

    pub(super) fn caustic_photons(&self) -> Option<&Photons> {
        self.caustics.as_ref().map(|c| &c.0.photons)
    }

    pub(super) fn photon_grid(&self) -> Option<&PhotonGridResources> {
        self.grid.as_ref()
    }

    pub(super) fn glossy_grid(&self) -> Option<&PhotonGridResources> {
        self.glossy_grid.as_ref()
    }

    pub(super) fn env_maps(&self) -> Option<&EnvMaps> {
        self.image_space.as_ref().map(|i| &i.env_maps)
    }

    pub(super) fn env_map_irradiance(&self) -> Option<&EnvMapIrradiance> {
        self.image_space.as_ref()?.lighting.as_ref().map(|l| &l.0)
    }

    pub(super) fn guiding_tables(&self) -> Option<&GuidingTables> {
        self.guiding.as_ref().map(|g| &g.0)
    }

    pub(super) fn depth_hierarchy(&self) -> Option<&DepthHierarchy> {
        self.image_space.as_ref()?.hierarchy.as_ref().map(|h| &h.0)
    }

    pub(super) fn env_maps_mut(&mut self) -> Option<&mut EnvMaps> {
        self.image_space.as_mut().map(|i| &mut i.env_maps)
    }

    /// Records the capture of what photons meet, their emission and their walk.
    pub(super) fn record(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        passes: &PhotonPasses,
        inputs: &PhotonInputs<'_>,
    ) -> Result<(), Error> {
        let scene = inputs.scene;
        if let Some(image_space) = &mut self.image_space {
            let capture_inputs = EnvMapCaptureInputs {
                env_maps: &image_space.env_maps,
                geometry: scene.geometry,
                views: inputs.views,
                layers: Some(inputs.layers),
                timestamps: scene.timestamps,
            };
            passes
                .env_map_capture
                .record(encoder, &mut image_space.capture, &capture_inputs);
            if let (Some(build), Some((hierarchy, own))) = (&passes.depth_hierarchy_build, &mut image_space.hierarchy) {
                let mut maps: Vec<u32> = inputs.layers.iter().map(|layer| layer / 6).collect();
                maps.dedup();
                let build_inputs = DepthHierarchyBuildInputs {
                    queue: scene.queue,
                    maps: Some(&maps),
                    env_maps: &image_space.env_maps,
                    hierarchy,
                    timestamps: scene.timestamps,
                };
                build.record(encoder, own, &build_inputs);
            }
        }
        if let (Some(pass), Some((tables, own))) = (&passes.photon_guiding, &mut self.guiding)
            && inputs.updates_guiding
        {
            let update_inputs = GuidingUpdateInputs {
                queue: scene.queue,
                tables,
                timestamps: scene.timestamps,
            };
            pass.record_update(encoder, own, &update_inputs);
        }
        let env_maps = self.image_space.as_ref();
        let mut walk_inputs = WalkInputs {
            photons: inputs,
            spread: match &self.guiding {
                None => PhotonSpread::Even,
                Some((tables, _)) => PhotonSpread::Guided(Guiding {
                    tables,
                    share: inputs.settings.guided_photons,
                }),
            },
            first_hits: inputs.settings.first_hits,
            maps: env_maps.map(|i| (&i.env_maps, i.hierarchy.as_ref().map(|h| &h.0))),
            sample_offset: scene.sample_offset,
        };
        match (&mut self.surface_lights, &mut self.illumination) {
            (Some(lights), _) => lights.record(encoder, passes, &mut self.global, walk_inputs)?,
            (_, Some(illumination)) => illumination.record(encoder, passes, &mut self.global, &walk_inputs)?,
            (None, None) => self.global.record(encoder, passes, &walk_inputs)?,
        }
        if let Some((caustics, targets)) = &mut self.caustics {
            walk_inputs.spread = PhotonSpread::Targets(targets);
            walk_inputs.first_hits = match inputs.settings.caustic_tracer() {
                TracerKind::Bvh => FirstHits::Traced,
                TracerKind::ImageSpace | TracerKind::Hybrid => inputs.settings.first_hits,
            };
            walk_inputs.sample_offset = inputs.settings.caustic_offset(scene.sample_offset);
            caustics.record(encoder, passes, &walk_inputs)?;
        }
        self.record_lighting(encoder, passes, inputs);
        for (pass, grid) in [
            (Some(&passes.photon_grid), &mut self.grid),
            (passes.glossy_grid.as_ref(), &mut self.glossy_grid),
        ] {
            let (Some(pass), Some(grid)) = (pass, grid) else {
                continue;
            };
            let grid_inputs = PhotonGridInputs {
                queue: scene.queue,
                photons: &self.global.photons,
                area: inputs.area,
                radius: inputs.radius,
                bandwidth: inputs.settings.splatter.bandwidth,
                timestamps: scene.timestamps,
            };
            pass.record(encoder, grid, &grid_inputs);
        }
        Ok(())
    }

    /// Of what environment maps show.
    fn record_lighting(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        passes: &PhotonPasses,
        inputs: &PhotonInputs<'_>,
    ) {
        if let (Some(pass), Some(image_space)) = (&passes.env_map_lighting, &mut self.image_space)
            && let Some((irradiance, own)) = &mut image_space.lighting
        {
            let lighting_inputs = EnvMapLightingInputs {
                queue: inputs.scene.queue,
                env_maps: &image_space.env_maps,
                photons: &self.global.photons,
                lights: inputs.lights,
                shadow_maps: inputs.shadow_maps,
                irradiance,
                area: inputs.area,
                radius: inputs.radius,
                sample_offset: inputs.scene.sample_offset,
                settings: &EnvMapLightingSettings {
                    bandwidth: Bandwidth::Density {
                        photons: inputs.settings.final_gather.photons,
                        clamp: [1.0; 2],
                    },
                    boundary: inputs.settings.splatter.boundary,
                },
                timestamps: inputs.scene.timestamps,
            };
            pass.record(encoder, own, &lighting_inputs);
        }
    }

    /// Bytes by resource.
    pub(super) fn memory_by_resource(&self) -> Vec<(&'static str, u64)> {
        let [photons, mut lost, mut uniforms] = self.global.memory_use();
        let mut list = vec![("photons", photons)];
        if let Some((tables, own)) = &self.guiding {
            list.push(("guiding_tables", tables.memory_use() + own.memory_use()));
        }
        if let Some(image_space) = &self.image_space {
            let maps = image_space.env_maps.memory_use() + image_space.capture.memory_use();
            list.push(("env_maps", maps));
            if let Some((hierarchy, own)) = &image_space.hierarchy {
                list.push(("depth_hierarchy", hierarchy.memory_use() + own.memory_use()));
            }
            if let Some((irradiance, own)) = &image_space.lighting {
                list.push(("env_map_lighting", irradiance.memory_use() + own.memory_use()));
            }
        }
        if let Some(lights) = &self.surface_lights {
            list.push(("surface_lights", lights.memory_use()));
        }
        if let Some(illumination) = &self.illumination {
            list.push(("illumination_maps", illumination.memory_use()));
        }
        if let Some((traced, targets)) = &self.caustics {
            let own = traced.memory_use();
            list.push(("caustic_photons", own[0]));
            lost += own[1];
            uniforms += own[2] + targets.memory_use();
        }
        if let Some(grid) = &self.grid {
            list.push(("photon_grid", grid.memory_use()));
        }
        if let Some(grid) = &self.glossy_grid {
            list.push(("glossy_grid", grid.memory_use()));
        }
        if lost > 0 {
            list.push(("lost_rays", lost));
        }
        list.push(("uniforms", uniforms));
        list
    }
}

//! Finds an adapter that core WebGPU runs on and opens a device.

use lightfall::wgpu;
use std::sync::{Arc, Mutex};

/// An open device, and every validation error that it reported.
pub(crate) struct Gpu {
    pub(crate) info: wgpu::AdapterInfo,
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    errors: Arc<Mutex<Vec<String>>>,
}

/// What to ask of a device beyond the defaults, where the adapter has it.
#[derive(Clone, Copy, Default)]
pub(crate) struct Wishes {
    /// Timestamp queries.
    pub(crate) timestamps: bool,
    /// Features without which the work cannot be done.
    pub(crate) features: wgpu::Features,
    /// Storage buffers as large as the adapter allows, instead of the 128 MiB that every device grants.
    pub(crate) large_buffers: bool,
}

impl Gpu {
    /// Opens the adapter whose name or backend contains `name` (any case), or the best there is: discrete first, software
    /// last.
    pub(crate) fn open(name: Option<&str>, wishes: Wishes) -> Result<Self, String> {
        let adapter = choose(name)?;
        let mut features = wishes.features;
        if wishes.timestamps {
            features |= adapter.features() & wgpu::Features::TIMESTAMP_QUERY;
        }
        let mut limits = wgpu::Limits::default();
        if wishes.large_buffers {
            let most = adapter.limits();
            limits.max_buffer_size = most.max_buffer_size;
            limits.max_storage_buffer_binding_size = most.max_storage_buffer_binding_size;
        }
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("lightfall example"),
            required_features: features,
            required_limits: limits,
            ..Default::default()
        };
        let info = adapter.get_info();
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|e| format!("adapter {:?} gave no device: {e}", info.name))?;
        let errors = Arc::new(Mutex::new(Vec::new()));
        let sink = Arc::clone(&errors);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            sink.lock().expect("no holder panics").push(error.to_string());
        }));
        Ok(Self {
            info,
            device,
            queue,
            errors,
        })
    }

    /// Validation and memory errors so far, in order.
    pub(crate) fn take_errors(&self) -> Vec<String> {
        std::mem::take(&mut self.errors.lock().expect("no holder panics"))
    }

    /// Name, backend and driver of the adapter.
    pub(crate) fn describe(&self) -> String {
        let wgpu::AdapterInfo {
            name,
            backend,
            driver_info,
            ..
        } = &self.info;
        format!("{name} ({backend}, {driver_info})")
    }

    /// Whether the device rendered as it was told; if not, nothing of it should be shown or written.
    pub(crate) fn check(&self) -> Result<(), String> {
        match self.take_errors().first() {
            Some(error) => Err(format!(
                "the device reported: {}",
                error.lines().next().unwrap_or_default()
            )),
            None => Ok(()),
        }
    }
}

/// All adapters, and whether each runs core WebGPU. GL, which does not, is asked only when there is nothing else: its
/// loader is talkative.
pub(crate) fn list() -> Vec<(wgpu::Adapter, bool)> {
    let primary = adapters(wgpu::Backends::PRIMARY);
    if primary.is_empty() {
        adapters(wgpu::Backends::SECONDARY)
    } else {
        primary
    }
}

fn adapters(backends: wgpu::Backends) -> Vec<(wgpu::Adapter, bool)> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends,
        ..wgpu::InstanceDescriptor::new_without_display_handle()
    });
    pollster::block_on(instance.enumerate_adapters(backends))
        .into_iter()
        .map(|adapter| {
            let usable = adapter.get_downlevel_capabilities().is_webgpu_compliant();
            (adapter, usable)
        })
        .collect()
}

fn choose(name: Option<&str>) -> Result<wgpu::Adapter, String> {
    let wanted = name.map(str::to_lowercase);
    let matches = |info: &wgpu::AdapterInfo| {
        wanted
            .as_ref()
            .is_none_or(|w| info.name.to_lowercase().contains(w) || info.backend.to_string().to_lowercase().contains(w))
    };
    let (mut usable, mut seen) = (Vec::new(), Vec::new());
    for (adapter, is_usable) in list() {
        let info = adapter.get_info();
        seen.push(format!("{} ({})", info.name, info.backend));
        if is_usable && matches(&info) {
            usable.push(adapter);
        }
    }
    usable.sort_by_key(|a| match a.get_info().device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    });
    usable.into_iter().next().ok_or_else(|| {
        let which = wanted.map_or(String::new(), |w| format!(" matching {w:?}"));
        let found = if seen.is_empty() {
            "none".to_owned()
        } else {
            seen.join(", ")
        };
        format!("no adapter{which} that runs core WebGPU (found: {found}); run examples/setup-adapter.sh")
    })
}

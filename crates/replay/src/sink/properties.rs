//! Sets properties of views and of entities in them, for which `re_sdk::blueprint` has no methods.

use re_sdk::blueprint::{Blueprint, BlueprintActivation, ContainerLike};
use re_sdk::external::re_log_types::{BlueprintActivationCommand, LogMsg, StoreKind};
use re_sdk::{
    ApplicationId, AsComponents, EntityPath, RecordingStream, RecordingStreamBuilder, RecordingStreamResult,
    SerializedComponentBatch,
};

/// Plain archetypes at `view/<id>/<archetype>` of the blueprint's store.
#[derive(Default)]
pub(super) struct ViewProperties(Vec<(EntityPath, Vec<SerializedComponentBatch>)>);

impl ViewProperties {
    /// Sets properties of a view.
    pub fn add_to_view<const N: usize>(
        &mut self,
        view: impl Into<ContainerLike>,
        properties: [(&str, &dyn AsComponents); N],
    ) -> ContainerLike {
        let view = view.into();
        if let ContainerLike::View(view) = &view {
            for (name, archetype) in properties {
                let path = view.blueprint_path().join(&EntityPath::from(name));
                self.0.push((path, archetype.as_serialized_batches()));
            }
        }
        view
    }

    /// Sets a property of one entity in a view.
    pub fn add_to_entity(&mut self, view: &ContainerLike, entity: &EntityPath, property: &dyn AsComponents) {
        if let ContainerLike::View(view) = view {
            let [before, after] = ["ViewContents/overrides", "visualizers"].map(EntityPath::from);
            let path = view.blueprint_path().join(&before).join(entity).join(&after);
            self.0.push((path, property.as_serialized_batches()));
        }
    }

    /// Sends a layout with these properties.
    pub fn send_blueprint(
        self,
        stream: &RecordingStream,
        application: &ApplicationId,
        blueprint: &Blueprint,
    ) -> RecordingStreamResult<()> {
        let (scratch, storage) = RecordingStreamBuilder::new(application.clone()).memory()?;
        blueprint.send(&scratch, BlueprintActivation::default())?;
        let mut messages = storage.take();
        messages.retain(|it| {
            let activates = matches!(it, LogMsg::BlueprintActivationCommand(_));
            it.store_id().kind() == StoreKind::Blueprint && !activates
        });
        let Some(id) = messages.first().map(|it| it.store_id().clone()) else {
            return Ok(());
        };
        let (extra, storage) = RecordingStreamBuilder::from_store_id(&id).memory()?;
        // The timeline of every blueprint.
        extra.set_time_sequence("blueprint", 0);
        for (path, batches) in self.0 {
            extra.log_serialized_batches(path, false, batches)?;
        }
        let settings = storage.take();
        messages.extend(settings.into_iter().filter(|it| matches!(it, LogMsg::ArrowMsg(..))));
        let activation =
            BlueprintActivationCommand { blueprint_id: id, make_active: true, make_default: true };
        stream.send_blueprint(messages, activation);
        Ok(())
    }
}

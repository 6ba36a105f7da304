"""``swarmctl keys``: makes the keys of SROS 2, and signs what they let nodes publish. Connects to no host."""

from __future__ import annotations

from swarmctl.cli import console, file_writes, next_command, options


def keys(spec: options.Spec, overlays: options.Overlays = None) -> None:
    """Make the keys of SROS 2 that are missing, and sign permissions that have changed.

    Private keys are secrets, in `secrets/` beside SPEC; certificates and permissions are in `keystore/`.
    """
    from swarmctl.deploy import secrets
    from swarmctl.deploy.sros2_keystore import KeystoreError, missing, secrets_of
    from swarmctl.render.build_bundle import bundles
    from swarmctl.spec.beside_files import ABSENT
    from swarmctl.spec.keystore import FOLDER, paths

    document = console.read_document(spec)
    swarm = console.swarm_of(document)
    enclaves = [one for bundle in bundles(swarm).values() for one in bundle.enclaves]
    if not enclaves:
        console.fail(
            "the spec does not use SROS 2", "write `ros: {sros2: true}` with a distribution of ROS 2"
        )
    for path in paths(document.spec):
        if (why := document.files.refused.get(path, ABSENT)) != ABSENT:
            console.fail(f"{path} {why}", "what cannot be read is not replaced")
    folder, names = spec.first.parent, secrets_of(enclaves)
    try:
        own = secrets.found(names, folder, forms=dict.fromkeys(names, "text"))
        found = missing(enclaves, swarm.keystore, own)
    except (KeystoreError, secrets.SecretError) as error:
        console.fail(str(error), error.fix)
    keys_folder = folder / secrets.FOLDER
    try:
        keys_folder.mkdir(mode=0o700, exist_ok=True)
        for path in found.files:
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        console.fail(console.cannot_write(error, folder))
    for name, key in found.secrets.items():
        file_writes.replace(keys_folder / name, key.encode(), 0o600)
    for path, content in found.files.items():
        file_writes.replace(folder / path, content)
    keystore = folder / FOLDER
    console.out().print(
        f"wrote {len(found.secrets)} keys to {keys_folder}, {len(found.files)} files to {keystore}"
    )
    next_command.advise("plan", spec)

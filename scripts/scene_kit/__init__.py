"""Parts of scripts/make_scenes.py: a glTF writer, shapes, pictures, and the example scenes themselves."""

"""Pages of the documentation that are made from the code: laws, effects, environments, commands, schemas, module index."""

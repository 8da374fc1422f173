"""The bus as a visitor sees it: topics, services, actions and their messages."""
